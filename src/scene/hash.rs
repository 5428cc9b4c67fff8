//! Fast hashing of positions and cells.

use std::hash::{BuildHasherDefault, Hasher};

/// Fast hashing of words. Hostile collisions only cost time, and the tables that use it are never
/// larger than the model.
pub(crate) type Mixed = BuildHasherDefault<Mixer>;

/// Multiplies and folds whole words.
#[derive(Default)]
pub(crate) struct Mixer(u64);

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        let h = (self.0 ^ (self.0 >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h ^ (h >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0xd6e8_feb8_6659_fd93);
        self.0 ^= self.0 >> 32;
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }
}

/// Mixes words into one.
pub(crate) fn mix(words: impl IntoIterator<Item = u64>) -> u64 {
    let mut mixer = Mixer::default();
    words.into_iter().for_each(|w| mixer.write_u64(w));
    mixer.finish()
}
