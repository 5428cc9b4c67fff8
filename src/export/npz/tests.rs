//! The archive byte by byte, read without the code that writes or reads it.

use super::*;
use crate::export::{read_npz, write_csv, write_mtx, write_npy};
use crate::matrix::Precision;
use crate::progress::Silent;
use crate::scene::Geometry;

/// A small matrix.
struct Small {
    rows: Vec<Vec<f64>>,
    precision: Precision,
}

impl Rows for Small {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn entries(&self) -> u64 {
        self.rows.iter().flatten().filter(|f| **f > 0.0).count() as u64
    }

    fn precision(&self) -> Precision {
        self.precision
    }

    fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
        let seen = (0..).zip(&self.rows[i]).filter(|e| *e.1 > 0.0);
        (*columns, *values) = seen.unzip();
        Ok(())
    }

    fn label(&self, i: usize) -> String {
        ["a", "b, or \"c\"", "d"][i].into()
    }

    fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
        (0..self.len())
            .map(|i| SurfaceRow { name: self.label(i), area: 2.0, ..SurfaceRow::default() })
            .collect()
    }

    fn rest(&self, i: usize) -> [f64; 2] {
        [0.25, i as f64 / 8.0]
    }
}

fn small(precision: Precision) -> Small {
    let rows = vec![vec![0.0, 0.5, 1e-7], vec![0.25, 0.0, 0.0], vec![0.0; 3]];
    Small { rows, precision }
}

fn written(matrix: &Small, index: Index, lumped: bool) -> Vec<u8> {
    let mut file = io::Cursor::new(Vec::new());
    let origin = Origin { scene: "s".into(), lumped, ..Origin::default() };
    let surfaces = matrix.surfaces(&Geometry::default());
    write_as(&mut file, matrix, &surfaces, &origin, index, &Silent).unwrap();
    file.into_inner()
}

/// The members of a zip archive by its central directory (APPNOTE 4.3.12), inflated.
fn members(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let u16_at = |at: usize| usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let end = bytes.len() - 22;
    assert_eq!(&bytes[end..end + 4], b"PK\x05\x06", "end of central directory");
    let mut at = u32_at(end + 16);
    let mut found = Vec::new();
    for _ in 0..u16_at(end + 10) {
        assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
        let (method, packed, size) = (u16_at(at + 10), u32_at(at + 20), u32_at(at + 24));
        let (name, local) = (u16_at(at + 28), u32_at(at + 42));
        let text = String::from_utf8(bytes[at + 46..at + 46 + name].to_vec()).unwrap();
        let data = local + 30 + u16_at(local + 26) + u16_at(local + 28);
        let packed = &bytes[data..data + packed];
        let mut plain = Vec::new();
        match method {
            0 => plain.extend(packed),
            8 => io::copy(&mut flate2::read::DeflateDecoder::new(packed), &mut plain)
                .map(|_| ())
                .unwrap(),
            other => panic!("method {other}"),
        }
        assert_eq!(plain.len(), size);
        found.push((text, plain));
        at += 46 + name + u16_at(at + 30) + u16_at(at + 32);
    }
    found
}

/// The dictionary and the bytes of an array.
fn array(bytes: &[u8]) -> (&str, &[u8]) {
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(end % 64, 0, "aligned");
    let text = std::str::from_utf8(&bytes[10..end]).unwrap();
    assert!(text.ends_with('\n'));
    (text.trim_end(), &bytes[end..])
}

#[test]
fn an_archive_holds_compressed_sparse_rows() {
    for (precision, index) in [
        (Precision::Single, Index::Int32),
        (Precision::Double, Index::Int64),
        (Precision::Single, Index::Int64),
    ] {
        let matrix = small(precision);
        let bytes = written(&matrix, index, true);
        let members = members(&bytes);
        let get = |name: &str| {
            let found = members.iter().find(|m| m.0 == format!("{name}.npy"));
            array(&found.unwrap_or_else(|| panic!("{name}")).1)
        };
        let dictionary = |descr: &str, shape: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}")
        };
        let wide = index == Index::Int64;
        let integers = |numbers: &[i64]| -> Vec<u8> {
            let bytes = |n: &i64| match wide {
                true => n.to_le_bytes().to_vec(),
                false => (*n as i32).to_le_bytes().to_vec(),
            };
            numbers.iter().flat_map(bytes).collect()
        };
        let kind = if wide { "<i8" } else { "<i4" };
        assert_eq!(get("format"), (&*dictionary("|S3", "()"), &b"csr"[..]));
        let shape: Vec<u8> = [3_i64, 3].iter().flat_map(|n| n.to_le_bytes()).collect();
        assert_eq!(get("shape"), (&*dictionary("<i8", "(2,)"), &*shape));
        assert_eq!(get("indptr"), (&*dictionary(kind, "(4,)"), &*integers(&[0, 2, 3, 3])));
        assert_eq!(get("indices"), (&*dictionary(kind, "(3,)"), &*integers(&[1, 2, 0])));
        let (descr, data): (_, Vec<u8>) = match precision {
            Precision::Single => {
                ("<f4", [0.5_f32, 1e-7, 0.25].iter().flat_map(|f| f.to_le_bytes()).collect())
            }
            Precision::Double => {
                ("<f8", [0.5_f64, 1e-7, 0.25].iter().flat_map(|f| f.to_le_bytes()).collect())
            }
        };
        assert_eq!(get("data"), (&*dictionary(descr, "(3,)"), &*data));
        let back: Vec<u8> = [0.0, 0.125, 0.25_f64].iter().flat_map(|f| f.to_le_bytes()).collect();
        assert_eq!(get("back").1, back);
        let (names, bytes) = get("names");
        assert_eq!(names, dictionary("<U9", "(3,)"));
        assert_eq!(bytes.len(), 3 * 9 * 4);
        let text: String = bytes[36..72]
            .chunks(4)
            .map(|c| char::from_u32(u32::from_le_bytes(c.try_into().unwrap())).unwrap())
            .collect();
        assert_eq!(text, "b, or \"c\"");
        assert!(String::from_utf8_lossy(get("hemicube").1).contains(r#""scene":"s""#));
    }
}

#[test]
fn counts_choose_the_width_of_integers() {
    let most = i32::MAX as u64;
    assert_eq!(Index::for_counts(5, most), Index::Int32);
    assert_eq!(Index::for_counts(5, most + 1), Index::Int64);
    assert_eq!(Index::for_counts(most + 1, 5), Index::Int64);
}

#[test]
fn what_was_written_reads_back_and_what_is_broken_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.npz");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let read = read_npz(&path, 1 << 30).map_err(|e| e.to_string());
        if let Err(message) = &read {
            assert!(message.contains("F.npz: ") && message.len() < 500, "{message}");
        }
        read
    };
    let whole = written(&small(Precision::Double), Index::Int64, false);
    let stored = read(&whole).unwrap();
    assert_eq!((&stored.starts[..], &stored.columns[..]), (&[0, 2, 3, 3][..], &[1, 2, 0][..]));
    assert_eq!(stored.values, [0.5, 1e-7, 0.25]);
    assert_eq!((stored.environment[2], stored.back[2]), (0.25, 0.25));
    assert_eq!(stored.origin.scene, "s");
    for length in 0..whole.len() {
        read(&whole[..length]).unwrap_err();
    }
    for at in 0..whole.len() {
        let mut changed = whole.clone();
        changed[at] ^= 0x55;
        // Some bytes do not matter; none may do harm.
        let _ = read(&changed);
    }
    assert!(read(b"PK").unwrap_err().contains("is no archive of arrays"));
    std::fs::write(&path, &whole).unwrap();
    assert!(read_npz(&path, 10).unwrap_err().to_string().contains("1 KiB are allowed"));
}

/// The same archive with one array changed, and its own checksums right.
fn changed(whole: &[u8], name: &str, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(io::Cursor::new(Vec::new()));
    for (member, mut bytes) in members(whole) {
        if member == format!("{name}.npy") {
            change(&mut bytes);
        }
        zip.start_file(member, SimpleFileOptions::default()).unwrap();
        zip.write_all(&bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn arrays_that_were_changed_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.npz");
    let whole = written(&small(Precision::Single), Index::Int32, false);
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        read_npz(&path, 1 << 30)
    };
    read(&changed(&whole, "data", |_| ())).unwrap();
    let refused = |name: &str, change: &dyn Fn(&mut Vec<u8>), expected: &str| {
        let message = read(&changed(&whole, name, change)).unwrap_err().to_string();
        assert!(message.contains("F.npz: ") && message.contains(expected), "{name}: {message}");
    };
    let last = |number: f64| {
        move |bytes: &mut Vec<u8>| {
            let end = bytes.len() - 8;
            bytes[end..].copy_from_slice(&number.to_le_bytes());
        }
    };
    let scaled = |bytes: &mut Vec<u8>| {
        for b in bytes[128..].as_chunks_mut::<4>().0 {
            *b = (f32::from_le_bytes(*b) * 1.5).to_le_bytes();
        }
    };
    refused("data", &scaled, "checksum");
    let unnamed = |bytes: &mut Vec<u8>| {
        let at = bytes.windows(8).position(|w| w == b"checksum").unwrap();
        bytes[at] = b'C';
    };
    refused(ORIGIN, &unnamed, "older version, without a checksum; make it again");
    refused("data", &|bytes| bytes[128..].reverse(), "data.npy");
    refused("shape", &last(f64::from_bits(4)), "shape.npy");
    for name in ["area", "environment", "back"] {
        refused(name, &last(f64::NAN), &format!("{name}.npy"));
        refused(name, &last(-0.5), &format!("{name}.npy"));
        refused(name, &last(0.125 + f64::EPSILON), "checksum");
        refused(name, &|bytes| bytes.truncate(bytes.len() - 8), &format!("{name}.npy is cut off"));
        refused(name, &|bytes| bytes.extend([0; 8]), "is longer than it says");
    }
}

#[test]
fn what_arrays_claim_to_hold_is_counted_before_any_is_inflated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.npz");
    let whole = written(&small(Precision::Single), Index::Int32, false);
    let read = |bytes: &[u8], memory: u64| {
        std::fs::write(&path, bytes).unwrap();
        read_npz(&path, memory).unwrap_err().to_string()
    };
    let claim = |bytes: &mut Vec<u8>, shape: &str| {
        *bytes = [header("<i8", shape), vec![0; 1 << 20]].concat();
    };
    // Zeros inflate a thousandfold: nobody may wait for them.
    let bomb = changed(&whole, "indptr", |bytes| claim(bytes, "(131072,)"));
    assert!(read(&bomb, 1 << 16).contains("indptr.npy holds 131072 numbers, not 4"));
    let bomb = changed(&whole, "indices", |bytes| claim(bytes, "(131072,)"));
    assert!(read(&bomb, 1 << 16).contains("64 KiB are allowed"));
    let rows = [1 << 31_u64; 2].map(u64::to_le_bytes).concat();
    let bomb = changed(&whole, "shape", |bytes| *bytes = [&header("<i8", "(2,)"), &*rows].concat());
    assert!(read(&bomb, 1 << 29).contains("512 MiB are allowed"));
    let text = [header("|S99999999", "()"), vec![b' '; 99_999_999]].concat();
    let bomb = changed(&whole, "hemicube", |bytes| *bytes = text.clone());
    assert!(read(&bomb, 1 << 30).contains("was not written by hemicube"));
}

/// A file without room for more than so many bytes.
struct Full(io::Cursor<Vec<u8>>, usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.get_ref().len().saturating_add(bytes.len()) > self.1 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Full {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_full_disk_is_one_error_wherever_it_comes() {
    let matrix = small(Precision::Double);
    let surfaces = matrix.surfaces(&Geometry::default());
    let write = |room: usize| {
        let mut file = Full(io::Cursor::default(), room);
        let origin = Origin::default();
        let written = write_as(&mut file, &matrix, &surfaces, &origin, Index::Int32, &Silent);
        written.map(|()| file.0.get_ref().len())
    };
    let size = write(usize::MAX).unwrap();
    for room in (0..size).step_by(7) {
        assert_eq!(write(room).unwrap_err().kind(), io::ErrorKind::StorageFull, "{room}");
    }
}

#[test]
fn dense_and_text_formats() {
    let matrix = small(Precision::Single);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F");
    write_npy(&path, &matrix, &Silent).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let (text, data) = array(&bytes);
    assert!(text.contains("'<f4'") && text.contains("(3, 3)"), "{text}");
    let dense: Vec<u8> =
        matrix.rows.iter().flatten().flat_map(|f| (*f as f32).to_le_bytes()).collect();
    assert_eq!(data, dense);
    write_mtx(&path, &matrix, &Origin::default(), &Silent).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with("% ")).collect();
    let banner = "%%MatrixMarket matrix coordinate real general";
    assert_eq!(lines, [banner, "3 3 3", "1 2 0.5", "1 3 1e-7", "2 1 0.25"]);
    let mut csv = Vec::new();
    write_csv(&mut csv, &matrix, &Silent).unwrap();
    let expected =
        "from,a,\"b, or \"\"c\"\"\",d\na,0,0.5,1e-7\n\"b, or \"\"c\"\"\",0.25,0,0\nd,0,0,0\n";
    assert_eq!(String::from_utf8(csv).unwrap(), expected);
}
