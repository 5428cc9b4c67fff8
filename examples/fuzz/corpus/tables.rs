//! Photometry of luminaires, and points to measure.

use super::{Input, Sound};

const PLAIN: &str = "IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] A = B, C\nTILT=NONE\n\
    1 1000 1 3 1 1 2 0 0 0\n1 1 50\n0 90 180\n0\n30 20 10\n";

const QUARTER: &str = "IESNA:LM-63-1995\n[TEST] 2\nTILT=INCLUDE\n1\n3\n0 45 90\n1 1.0 1\n\
    2 900 .5 5 3 1 1 .5 1 .1\n.9 .95 80\n0 30 60 85 90\n0 45 90\n\
    90 80 50 9 0\n95 85 40 8 0\n99 70 30 7 0\n";

const FLOODLIGHT: &str = "IESNA91\nTILT=NONE\n1 -1 2 5 3 2 2 -.2 -.2 0 1 1 100\n\
    -90 -45 0 45 90\n-30 0 30\n0 5 9 5 0\n0 6 9 6 0\n0 5 9 5 0\n";

const HEADLIGHT: &str = "IESNA86\nTILT=NONE\n1 800 1 3 2 3 2 0 0 0 1 1 9\n\
    -20 0 20\n0 40\n1 2 1\n3 4 3\n";

pub fn ies() -> Sound {
    let all = [PLAIN, QUARTER, FLOODLIGHT, HEADLIGHT];
    Ok(all.map(|text| Input::new("lamp.ies", text)).into())
}

pub fn points() -> Sound {
    const PLAIN: &str = "x,y,z,nx,ny,nz\n0.5,0.5,0.5,0,1,0\n0.2,0.9,0.1,0,0,-1\n";
    const OTHERS: &str = "\u{feff}\"name\",nz,ny,nx,x,y,z,E\r\n\
        \"a,b\",0,2,0,\"1\",0,0.5,old\r\n\r\nc,0,1,0,.3,-2.5e-1,0.5,\r\n";
    Ok([PLAIN, OTHERS].map(|text| Input::new("points.csv", text)).into())
}
