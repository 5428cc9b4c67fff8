//! References of a glTF file: data in place, or a file beside it.

use std::sync::Arc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::scene::shortened::shortened;
use crate::scene::source::Source;

/// Exporters disagree about padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes that a URI stands for, or what is wrong with it.
pub fn read(source: &Source<'_>, uri: &str) -> Result<Arc<[u8]>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((kind, data)) = data.split_once(',') else {
            return Err("its data URI has no data".into());
        };
        return if kind.ends_with(";base64") {
            BASE64
                .decode(data)
                .map(Into::into)
                .map_err(|e| format!("its data URI is not base64: {e}"))
        } else {
            Ok(percent_decoded(data).into())
        };
    }
    if uri.contains("://") {
        return Err(format!("{} is not a file", shortened(uri)));
    }
    let decoded = percent_decoded(uri);
    let name = String::from_utf8_lossy(&decoded);
    // Some exporters do not encode, and a name may contain a percent sign.
    let Some(path) = source.beside(&name).or_else(|| source.beside(uri)) else {
        return Err(format!("the file {} is missing", shortened(&name)));
    };
    source.read(&path).map_err(|e| format!("{} cannot be read ({e})", path.display()))
}

fn percent_decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let digit = |at: usize| bytes.get(at).and_then(|&b| char::from(b).to_digit(16));
        match (bytes[i], digit(i + 1), digit(i + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((high * 16 + low) as u8);
                i += 3;
            }
            (byte, ..) => {
                out.push(byte);
                i += 1;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_decode_only_before_two_digits() {
        assert_eq!(percent_decoded("a%20b%C3%A9"), "a bé".as_bytes());
        assert_eq!(percent_decoded("100%"), b"100%");
        assert_eq!(percent_decoded("%zz%4"), b"%zz%4");
    }
}
