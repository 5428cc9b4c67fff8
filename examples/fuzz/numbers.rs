//! Numbers that programs stumble over.

use crate::random::Random;

/// As text.
const TEXTS: &str = "0 -0 -1 1 2 3 7 0.5 -0.5 1e-300 1e-45 1e-9 1e6 1e15 1.1e15 1e30 1e38 1e39 \
    1e100 1e154 \
    1e155 1e308 -1e308 1e309 nan -nan inf -inf infinity 90 180 360 127 128 255 256 32767 \
    32768 65535 65536 1000000 16777217 2147483647 2147483648 -2147483648 4294967295 \
    4294967296 9007199254740993 9223372036854775807 9223372036854775808 \
    -9223372036854775808 18446744073709551615 18446744073709551616 1e 1e- . + - 0x10 1_000 \
    1,5 00000001 99999999999999999999999999999999999999999999";

#[rustfmt::skip]
const WHOLE: &[u64] = &[
    0, 1, 2, 3, 4, 7, 8, 16, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff, 0x1_0000,
    0xff_ffff, 0x3fff_ffff, 0x7fff_ffff, 0x8000_0000, 0xffff_fffe, 0xffff_ffff, 0x1_0000_0000,
    i64::MAX as u64, 1 << 63, u64::MAX - 1, u64::MAX,
];

#[rustfmt::skip]
const REAL: &[f64] = &[
    0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-300, 1e-45, 1e-9, 1e9, 1e15, 1.1e15, 1e30, 1e38, 1e39,
    1e100, 1e155, 1e308, -1e308, f64::MAX, f64::MIN_POSITIVE, f64::INFINITY, f64::NEG_INFINITY,
    f64::NAN,
];

/// One of them as text, rarely a very long one.
pub fn text(random: &mut Random) -> String {
    if random.one_in(40) {
        return "9".repeat(1 << random.below(14));
    }
    let all: Vec<&str> = TEXTS.split(' ').collect();
    (*random.pick(&all)).to_owned()
}

/// One of them as a double.
pub fn real(random: &mut Random) -> f64 {
    *random.pick(REAL)
}

/// One of them as bytes: an integer or a float of 1, 2, 4 or 8 bytes, of either order.
pub fn bytes(random: &mut Random) -> Vec<u8> {
    let whole = *random.pick(WHOLE);
    let real = real(random);
    let little = match random.below(6) {
        0 => vec![whole as u8],
        1 => (whole as u16).to_le_bytes().to_vec(),
        2 => (whole as u32).to_le_bytes().to_vec(),
        3 => whole.to_le_bytes().to_vec(),
        4 => (real as f32).to_le_bytes().to_vec(),
        _ => real.to_le_bytes().to_vec(),
    };
    if random.one_in(4) { little.into_iter().rev().collect() } else { little }
}
