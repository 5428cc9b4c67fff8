//! Models as text: OBJ and View3D.

use super::{Input, Sound, images};

/// A room with a lamp, every kind of face and every kind of name.
const ROOM: &str = "# a room\nmtllib room.mtl other.mtl\no room\n\
    v 0 0 0\nv 4 0 0\nv 4 0 3 0.5 0.4 1\nv 0 0 3\nv 0 2.5 0\nv 4 2.5 0\nv 4 2.5 3\nv 0 2.5 3\n\
    v 1 2.4 1\nv 3 2.4 1\nv 3 2.4 2\nv 1 2.4 2\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1 0\nvn 0 1 0\n\
    g floor\nusemtl wood\nf 1/1 4/2 3/3 2/4\n\
    g walls other\nusemtl white\nf 1//1 2//1 6//1 5//1\nf 2/1/1 3/2/1 7/3/1 6/4/1\n\
    f 3 4 8 7\nf 4 1 5 8\ns off\ng ceiling\nf 5 6 7 8\n\
    o lamp\nusemtl lamp\nf -4 -3 -2 -1\nl 1 2\np 3\n";

const MATERIALS: &str = "newmtl wood\nKd 0.6 0.4 0.2\nmap_Kd -s 2 2 -o 0.5 0 map.png\n\
    newmtl white\nKa 0 0 0\nKd 0.8 0.8 0.8\nKs 0.1 0.1 0.1\nNs 10\nillum 2\nd 1\nmap_Ke map.jpg\n\
    newmtl lamp\nKd 0 0 0\nKe 10 9 8\nTr 0\n";

/// An L of six corners, a bow tie, a spike, a face of no area, and one that is there twice.
const FLAWS: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 5 5 5 \\\n\n\
    v 1e-6 0 0\nf 1 2 3 4 5 6\nf 1 3 2 6\nf 1 2 8\nf 1 1 2\nf 1 2 3\nf 1 2 3\nf 3 2 1\nf 1 7 2\n";

/// A leaf whose picture says what is there.
const LEAF: &str = "mtllib leaf.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 2 0\nvt 2 2\n\
    vt 0 2\nusemtl leaf\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

const LEAF_MATERIAL: &str =
    "newmtl leaf\nKd 0.5 0.9 0.4\nKe 1 1 1\nmap_Kd map.png\nmap_d map.png\n";

pub fn obj() -> Sound {
    let (png, jpeg) = (images::masked()?, images::jpeg()?);
    let room = Input::new("room.obj", ROOM).and("room.mtl", MATERIALS);
    Ok(vec![
        room.and("map.png", png.clone()).and("map.jpg", jpeg),
        Input::new("flaws.obj", FLAWS),
        Input::new("leaf.obj", LEAF).and("leaf.mtl", LEAF_MATERIAL).and("map.png", png),
    ])
}

const CUBE: &str = "T a cube\nC encl=1 list=2 eps=1.e-4 out=1 maxU=8 maxO=8 row=2 maxD=500\nF 3\n\
    V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n\
    S 1 1 2 3 4 0 0 .5 floor\nS 2 8 7 6 5 0 0 .25 roof\nS 3 1 5 6 0 0 2 .25 side\n\
    S 4 1 6 2 0 0 0 .9 side 2\nO 5 1 4 8 5 and more\nO 6 1 4 8 0\nEnd of data\n";

const PLANES: &str = "F 3A\nS 1 R 0 0 .9 south\n 3. 0. 0. 0 90\n 3 2\n\
    S 2 R 0 0 .9 east\n 3 1 0 270 90\n 1 3\n\
    S 3 Q 0 0 .9 ceiling\n 3 0 3 0 180\n 2 0 3 0 3 1\n 2 1\n\
    S 4 T 0 0 .9 floor\n 0 0 0 180 0\n 0 0 1 0 1 1\nO 5 R\n 0 0 1 180 0\n 2 2\n";

/// A wall with a window in it.
const WINDOW: &str = "F 3\nV 1 0 0 0\nV 2 4 0 0\nV 3 4 0 3\nV 4 0 0 3\nV 5 1 0 1\nV 6 2 0 1\n\
    V 7 2 0 2\nV 8 1 0 2\nV 9 0 5 0\nV 10 4 5 0\nV 11 4 5 3\nV 12 0 5 3\n\
    S 1 4 3 2 1 0 0 .9 wall\nS 2 8 7 6 5 1 0 .8 window\nS 3 9 10 11 12 0 0 .9 far\nEnd\n";

pub fn vs3() -> Sound {
    Ok([CUBE, PLANES, WINDOW].map(|text| Input::new("m.vs3", text)).into())
}
