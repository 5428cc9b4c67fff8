//! Work that several processes share, as MPI starts them: each does a part of it, and all hear what
//! the others found.
//!
//! What is numbered is cut into strips of consecutive numbers, whose length depends on how many
//! there are alone; strip k is the work of rank k modulo the number of ranks. So neighbours stay
//! together, every rank has some of everything, and what is found strip by strip is the same to
//! the last bit for any number of ranks.

use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

use thiserror::Error;

/// Lets the processes of a job speak to each other. All of them make the same calls in the same
/// order; a call returns once all have made it.
pub trait Communicator: Debug + Send + Sync {
    /// The number of this process, 0 to [`size`](Self::size) - 1.
    fn rank(&self) -> usize;

    /// How many processes there are, at least 1.
    fn size(&self) -> usize;

    /// What every process gave, in the order of ranks.
    ///
    /// # Errors
    /// If they cannot reach each other.
    fn all_gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError>;

    /// The same for rank 0 alone; others need not be told anything.
    ///
    /// # Errors
    /// If they cannot reach each other.
    fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError>;
}

/// Why processes could not work together.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum RanksError {
    /// They cannot reach each other.
    #[error("the ranks cannot reach each other: {0}")]
    Unreachable(String),
    /// One has another scene, or other options.
    #[error(
        "rank {rank} has another model or other options than rank 0: all ranks must read the same \
         files"
    )]
    Different {
        /// The other one.
        rank: usize,
    },
    /// One does not do the same work as this one.
    #[error(
        "rank {rank} sent {sent} bytes, and not {due}: all ranks must have the same scene and the \
         same options"
    )]
    Apart {
        /// The other one.
        rank: usize,
        /// Bytes that it sent.
        sent: usize,
        /// Bytes that it was to send.
        due: usize,
    },
}

/// Who shares the work: by default nobody, and this process does all of it.
#[derive(Debug, Clone, Default)]
pub struct Ranks(Option<Arc<dyn Communicator>>);

/// Things in a strip at least and at most, and about how many strips there are. Multiples of what
/// is looked at together: then it is the same for any number of ranks.
const TOGETHER: usize = 64;
const MOST: usize = 64 * TOGETHER;
const STRIPS: usize = 1024;

/// The strips of so many things.
pub fn strips(count: usize) -> impl Iterator<Item = Range<usize>> {
    let length = (count / STRIPS).next_multiple_of(TOGETHER).clamp(TOGETHER, MOST);
    (0..count).step_by(length).map(move |from| from..count.min(from + length))
}

impl Ranks {
    /// The processes that a communicator lets speak to each other; a single one too works strip by
    /// strip, and finds what many would.
    #[must_use]
    pub fn of(communicator: Arc<dyn Communicator>) -> Self {
        Self(Some(communicator))
    }

    /// Whether this process does everything, and in one go.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.0.is_none()
    }

    /// Whether this process writes results: rank 0.
    #[must_use]
    pub fn is_first(&self) -> bool {
        self.place().0 == 0
    }

    /// How many there are.
    #[must_use]
    pub fn size(&self) -> usize {
        self.place().1
    }

    /// The rank of this process, and how many there are.
    fn place(&self) -> (usize, usize) {
        self.0.as_ref().map_or((0, 1), |c| (c.rank(), c.size().max(1)))
    }

    /// Of something for each strip, what is for this rank.
    pub fn own<T>(&self, of_strips: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
        let (rank, size) = self.place();
        of_strips.into_iter().skip(rank).step_by(size)
    }

    /// The values of all strips, of which each rank found those of its own; `counts` says how many
    /// each strip has.
    ///
    /// # Errors
    /// If another rank found more or fewer, or they cannot reach each other.
    pub fn share<T: Wire>(&self, counts: &[usize], own: Vec<T>) -> Result<Vec<T>, RanksError> {
        let Some(communicator) = &self.0 else { return Ok(own) };
        in_order(&communicator.all_gather(&to_bytes(&own))?, self.size(), counts)
    }

    /// The same for rank 0 alone: nothing for the others.
    ///
    /// # Errors
    /// As [`share`](Self::share).
    pub fn collect<T: Wire>(&self, counts: &[usize], own: Vec<T>) -> Result<Vec<T>, RanksError> {
        let Some(communicator) = &self.0 else { return Ok(own) };
        let found = communicator.gather(&to_bytes(&own))?;
        if !self.is_first() {
            return Ok(Vec::new());
        }
        in_order(&found, self.size(), counts)
    }

    /// One value of every rank.
    ///
    /// # Errors
    /// If they cannot reach each other.
    pub fn every<T: Wire>(&self, own: T) -> Result<Vec<T>, RanksError> {
        let Some(communicator) = &self.0 else { return Ok(vec![own]) };
        let found = communicator.all_gather(&to_bytes(&[own]))?;
        let value = |(rank, bytes): (usize, Vec<u8>)| match bytes.len() == T::BYTES {
            true => Ok(T::read(&bytes)),
            false => Err(RanksError::Apart { rank, sent: bytes.len(), due: T::BYTES }),
        };
        found.into_iter().enumerate().map(value).collect()
    }

    /// Sets what any rank has set.
    ///
    /// # Errors
    /// If they cannot reach each other.
    pub fn unite(&self, flags: &mut [bool]) -> Result<(), RanksError> {
        let Some(communicator) = &self.0 else { return Ok(()) };
        let packed = |flags: &[bool]| (0..).zip(flags).fold(0, |b, (k, f)| b | u8::from(*f) << k);
        let own: Vec<u8> = flags.chunks(8).map(packed).collect();
        for (rank, bytes) in communicator.all_gather(&own)?.into_iter().enumerate() {
            if bytes.len() != own.len() {
                return Err(RanksError::Apart { rank, sent: bytes.len(), due: own.len() });
            }
            for (flags, byte) in flags.chunks_mut(8).zip(bytes) {
                (0..).zip(flags).for_each(|(k, flag)| *flag |= byte >> k & 1 == 1);
            }
        }
        Ok(())
    }
}

/// The values of strips in their order, from what each rank found of its own.
fn in_order<T: Wire>(
    found: &[Vec<u8>],
    size: usize,
    counts: &[usize],
) -> Result<Vec<T>, RanksError> {
    for rank in 0..size {
        let due = T::BYTES * counts.iter().skip(rank).step_by(size).sum::<usize>();
        let sent = found.get(rank).map_or(0, Vec::len);
        if sent != due {
            return Err(RanksError::Apart { rank, sent, due });
        }
    }
    let mut rests: Vec<&[u8]> = found.iter().map(Vec::as_slice).collect();
    let mut all = Vec::with_capacity(counts.iter().sum());
    for (strip, count) in counts.iter().enumerate() {
        let (now, rest) = rests[strip % size].split_at(T::BYTES * count);
        all.extend(now.chunks_exact(T::BYTES).map(T::read));
        rests[strip % size] = rest;
    }
    Ok(all)
}

/// A value as ranks send it: its bytes, the lowest first.
pub trait Wire: Copy {
    /// How many.
    const BYTES: usize;
    /// Appends them.
    fn write(self, bytes: &mut Vec<u8>);
    /// The value of so many bytes.
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($($type:ty),*) => {$(
        impl Wire for $type {
            const BYTES: usize = size_of::<$type>();

            fn write(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }

            fn read(bytes: &[u8]) -> Self {
                bytes.try_into().map_or_else(|_| Self::default(), Self::from_le_bytes)
            }
        }
    )*};
}

number!(u32, u64, f32, f64);

impl<T: Wire, const N: usize> Wire for [T; N] {
    const BYTES: usize = N * T::BYTES;

    fn write(self, bytes: &mut Vec<u8>) {
        self.into_iter().for_each(|value| value.write(bytes));
    }

    fn read(bytes: &[u8]) -> Self {
        std::array::from_fn(|k| T::read(&bytes[k * T::BYTES..][..T::BYTES]))
    }
}

fn to_bytes<T: Wire>(values: &[T]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(T::BYTES * values.len());
    values.iter().for_each(|value| value.write(&mut bytes));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of so many, to which the others seem to say what `said` holds.
    #[derive(Debug)]
    struct Told {
        rank: usize,
        said: Vec<Vec<u8>>,
    }

    impl Communicator for Told {
        fn rank(&self) -> usize {
            self.rank
        }

        fn size(&self) -> usize {
            self.said.len()
        }

        fn all_gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
            let mut all = self.said.clone();
            all[self.rank] = own.to_vec();
            Ok(all)
        }

        fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
            self.all_gather(own)
        }
    }

    fn told(rank: usize, said: Vec<Vec<u8>>) -> Ranks {
        Ranks::of(Arc::new(Told { rank, said }))
    }

    #[test]
    fn strips_are_whole_and_depend_on_the_number_alone() {
        for count in [0, 1, 63, 64, 65, 1000, 70_000, 1_000_000, 20_000_000] {
            let all: Vec<Range<usize>> = strips(count).collect();
            assert_eq!(all.iter().map(Range::len).sum::<usize>(), count);
            assert!(all.windows(2).all(|w| w[0].end == w[1].start));
            assert!(all.iter().all(|s| s.start % TOGETHER == 0 && s.len() <= MOST));
        }
        assert_eq!(strips(1_000_000).count(), 977);
    }

    #[test]
    fn what_ranks_found_comes_in_the_order_of_strips() {
        let counts = [2, 1, 0, 3, 1];
        let second = to_bytes(&[2_u32, 30, 31, 32]);
        let ranks = told(0, vec![vec![], second.clone()]);
        let all = ranks.share(&counts, vec![0_u32, 1, 40]).unwrap();
        assert_eq!(all, [0, 1, 2, 30, 31, 32, 40]);
        assert_eq!(ranks.own(counts).collect::<Vec<_>>(), [2, 0, 1]);
        assert_eq!(ranks.collect(&counts, vec![0_u32, 1, 40]).unwrap(), all);
        let other = told(1, vec![vec![], vec![]]).collect(&counts, vec![2_u32, 30, 31, 32]);
        assert!(other.unwrap().is_empty());
        // A single rank, and nobody at all.
        let single = told(0, vec![vec![]]);
        assert_eq!(single.share(&[1, 2], vec![7.0, 8.0, 9.0]).unwrap(), [7.0, 8.0, 9.0]);
        assert_eq!(Ranks::default().share(&[3], vec![7.0]).unwrap(), [7.0]);
        // One that does other work.
        let wrong = told(0, vec![vec![], second[1..].to_vec()]).share(&counts, vec![0_u32, 1, 40]);
        assert_eq!(wrong.unwrap_err(), RanksError::Apart { rank: 1, sent: 15, due: 16 });
    }

    #[test]
    fn flags_are_united() {
        let mut flags = [true, false, false, false, false, false, false, false, true, false];
        told(1, vec![vec![0b1000_0010, 0b10], vec![]]).unite(&mut flags).unwrap();
        let set: Vec<usize> = (0..10).filter(|&k| flags[k]).collect();
        assert_eq!(set, [0, 1, 7, 8, 9]);
        assert!(told(1, vec![vec![0], vec![]]).unite(&mut flags).is_err());
    }

    #[test]
    fn values_survive_the_wire() {
        let values = [[1.5, -0.0, f64::MAX], [f64::MIN_POSITIVE, 0.1, 1e300]];
        let bytes = to_bytes(&values);
        assert_eq!(bytes.len(), 2 * <[f64; 3]>::BYTES);
        let back: Vec<[f64; 3]> = bytes.chunks_exact(24).map(Wire::read).collect();
        assert_eq!(back, values);
        assert_eq!(told(0, vec![vec![], to_bytes(&[9_u64])]).every(7_u64).unwrap(), [7, 9]);
    }
}
