//! Archives: one member is changed, and all checksums are right again.

use std::io::{Cursor, Read, Write};

use serde_json::Value;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::{array, wrong as any_wrong};
use crate::random::Random;

type Member = (String, Vec<u8>);

pub fn wrong(file: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let mut members = members(file)?;
    let n = members.len();
    if n == 0 {
        return None;
    }
    // The manifest says what all others are.
    let manifest = members.iter().position(|m| m.0 == "manifest.json");
    let at = manifest.filter(|_| random.one_in(3)).unwrap_or_else(|| random.below(n));
    match random.below(12) {
        0 => drop(members.remove(at)),
        1 => {
            let other = members[random.below(n)].1.clone();
            members[at].1 = other;
        }
        _ => members[at].1 = any_wrong(&members[at].1, random),
    }
    if !random.one_in(16) {
        seal(&mut members);
    }
    pack(&members, random.one_in(4)).ok()
}

fn members(file: &[u8]) -> Option<Vec<Member>> {
    let mut zip = ZipArchive::new(Cursor::new(file)).ok()?;
    let mut members = Vec::new();
    for i in 0..zip.len() {
        let mut member = zip.by_index(i).ok()?;
        let name = member.name().ok()?.into_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).ok()?;
        members.push((name, bytes));
    }
    Some(members)
}

fn pack(members: &[Member], packed: bool) -> zip::result::ZipResult<Vec<u8>> {
    let method = if packed { CompressionMethod::Deflated } else { CompressionMethod::Stored };
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(name, SimpleFileOptions::default().compression_method(method))?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// Makes the checksums right: those of the parts of a file of solutions, or that of
/// rows, a part or a matrix.
fn seal(members: &mut [Member]) {
    if let Some(at) = members.iter().position(|m| m.0 == "manifest.json") {
        let Ok(mut manifest) = serde_json::from_slice::<Value>(&members[at].1) else { return };
        for part in ["scene", "light", "factors"] {
            let sum = checksum(members, |name| name.split('/').next() == Some(part));
            if let Some(place) = manifest.pointer_mut(&format!("/checksums/{part}")) {
                *place = sum.into();
            }
        }
        let sum = checksum(members, |name| name != "manifest.json");
        if let Some(place) = manifest.pointer_mut("/checksum") {
            *place = sum.into();
        }
        members[at].1 = manifest.to_string().into_bytes();
    } else if let Some(at) = members.iter().position(|m| m.0 == "checksum") {
        members[at].1 = checksum(members, |name| name != "checksum").into_bytes();
    } else if let Some(at) = members.iter().position(|m| m.0 == "hemicube.npy") {
        let sum = checksum(members, |name| name != "hemicube.npy" && name != "names.npy");
        let start = members[at].1.iter().position(|b| *b == b'\n').map_or(0, |end| end + 1);
        let origin = serde_json::from_slice::<Value>(&members[at].1[start..]);
        let Ok(Value::Object(mut origin)) = origin else { return };
        origin.insert("checksum".into(), sum.into());
        let text = Value::Object(origin).to_string();
        let header =
            format!("{{'descr': '|S{}', 'fortran_order': False, 'shape': (), }}\n", text.len());
        members[at].1 = array::with(header.as_bytes(), text.as_bytes());
    }
}

fn checksum(members: &[Member], of: impl Fn(&str) -> bool) -> String {
    let mut hash = blake3::Hasher::new();
    members.iter().filter(|m| of(&m.0)).for_each(|m| {
        hash.update(&m.1);
    });
    hash.finalize().to_hex().to_string()
}
