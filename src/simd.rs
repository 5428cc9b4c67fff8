//! Compiles a kernel several times and picks the widest one that this processor runs.
//!
//! This is the only `unsafe` code. The argument: a `#[target_feature]` function may be
//! called where the processor has the features, and each call stands behind the run-time check
//! for exactly the features that the function was compiled for. The kernels themselves are safe
//! code; no arithmetic is contracted, so all versions give the same bits.

use std::sync::atomic::{AtomicU8, Ordering};

/// Kernels work on blocks of this many numbers of single precision.
pub(crate) const LANES: usize = 16;

/// The versions of each kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Version {
    /// What every processor of this architecture runs.
    Portable,
    /// With `avx2`, `bmi1`, `bmi2`, `lzcnt`, `popcnt`.
    Avx2,
    /// With those, `avx512f`, `avx512bw`, `avx512dq`, `avx512vl`.
    Avx512,
}

impl Version {
    /// The widest that this processor runs, within the [`limit`].
    #[must_use]
    pub fn detect() -> Self {
        #[cfg(not(target_arch = "x86_64"))]
        return Self::Portable;
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = std::is_x86_feature_detected!("avx2")
                && std::is_x86_feature_detected!("bmi1")
                && std::is_x86_feature_detected!("bmi2")
                && std::is_x86_feature_detected!("lzcnt")
                && std::is_x86_feature_detected!("popcnt");
            let avx512 = avx2
                && std::is_x86_feature_detected!("avx512f")
                && std::is_x86_feature_detected!("avx512bw")
                && std::is_x86_feature_detected!("avx512dq")
                && std::is_x86_feature_detected!("avx512vl");
            let detected = match (avx2, avx512) {
                (_, true) => Self::Avx512,
                (true, _) => Self::Avx2,
                _ => Self::Portable,
            };
            detected.min(widest())
        }
    }
}

/// Has no wider version run from now on, so that programs that measure can compare them. Results
/// are the same.
pub fn limit(widest: Version) {
    LIMIT.store(widest as u8, Ordering::Relaxed);
}

static LIMIT: AtomicU8 = AtomicU8::new(Version::Avx512 as u8);

#[cfg(target_arch = "x86_64")]
fn widest() -> Version {
    let all = [Version::Portable, Version::Avx2, Version::Avx512];
    let widest = all[LIMIT.load(Ordering::Relaxed) as usize % all.len()];
    #[cfg(test)]
    let widest = widest.min(WIDEST.get());
    widest
}

#[cfg(test)]
thread_local! {
    /// No wider version is run on this thread.
    pub(crate) static WIDEST: std::cell::Cell<Version> =
        const { std::cell::Cell::new(Version::Avx512) };
}

/// Defines `fn $name(args)` that runs `$kernel` (an `#[inline(always)]` function) compiled for the
/// widest vectors at hand.
macro_rules! multiversion {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $ty:ty),* $(,)?) = $kernel:path) => {
        $(#[$meta])*
        #[allow(unsafe_code)]
        $vis fn $name($($arg: $ty),*) {
            #[cfg(target_arch = "x86_64")]
            {
                use $crate::simd::Version;
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
                #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
                fn avx512($($arg: $ty),*) {
                    $kernel($($arg),*)
                }
                #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
                fn avx2($($arg: $ty),*) {
                    $kernel($($arg),*)
                }
                match Version::detect() {
                    // SAFETY: every feature that `avx512` enables was just detected.
                    Version::Avx512 => return unsafe { avx512($($arg),*) },
                    // SAFETY: every feature that `avx2` enables was just detected.
                    Version::Avx2 => return unsafe { avx2($($arg),*) },
                    Version::Portable => {}
                }
            }
            $kernel($($arg),*)
        }
    };
}
pub(crate) use multiversion;
