//! Places in the order of the hierarchy. Ids of patches, nodes and tiles are of other types, so
//! that they cannot be mixed up.

use std::ops::Range;

/// The place of a patch in the order of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(pub u32);

/// A node of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NodeId(pub u32);

/// A tile, in the order of their patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TileId(pub u32);

/// Places in a group. Shadow rays to one group are in doubt together (`shadow_rays`).
const GROUP: u32 = 16;

impl Place {
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The places whose rays share packets with those that go to this one. Some may lie beyond the
    /// last.
    pub fn group(self) -> Places {
        let from = self.0 / GROUP * GROUP;
        Places { from, to: from + GROUP }
    }
}

impl TileId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A run of places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Places {
    from: u32,
    to: u32,
}

impl Places {
    pub fn new(range: Range<usize>) -> Self {
        Self { from: range.start as u32, to: range.end as u32 }
    }

    pub fn one(at: Place) -> Self {
        Self { from: at.0, to: at.0 + 1 }
    }

    /// Those from `first` on.
    pub fn since(self, first: Place) -> Self {
        Self { from: first.0, ..self }
    }

    pub fn first(self) -> Place {
        Place(self.from)
    }

    /// The place that is so far from the first.
    pub fn at(self, offset: usize) -> Place {
        Place(self.from + offset as u32)
    }

    pub fn len(self) -> usize {
        self.to.saturating_sub(self.from) as usize
    }

    pub fn contains(self, at: Place) -> bool {
        (self.from..self.to).contains(&at.0)
    }

    pub fn range(self) -> Range<usize> {
        self.from as usize..self.to as usize
    }

    pub fn iter(self) -> impl Iterator<Item = Place> {
        (self.from..self.to).map(Place)
    }

    /// How far a place is from the first.
    pub fn offset(self, at: Place) -> usize {
        (at.0 - self.from) as usize
    }

    /// From the group of the first place to that of the last.
    pub fn groups(self) -> Self {
        let last = Place(self.to.max(self.from + 1) - 1);
        Self { from: self.first().group().from, to: last.group().to }
    }
}

/// Patches whose pairs alone are asked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wanted<'a> {
    /// All pairs.
    All,
    /// Those of these patches, in all their digits: with others that are traced together with them.
    Rows(&'a [bool]),
    /// Nearly those of these patches, as a sample: without such others.
    Sample(&'a [bool]),
    /// The pair of these.
    Pair([Place; 2]),
}

impl Wanted<'_> {
    /// Whether pairs between two runs of patches, or others traced together with them, are wanted.
    pub fn has(self, rows: Places, columns: Places) -> bool {
        let (wanted, columns) = match self {
            Self::All => return true,
            Self::Rows(wanted) => (wanted, columns.groups()),
            Self::Sample(wanted) => (wanted, columns),
            Self::Pair([i, j]) => {
                return rows.contains(i) && columns.contains(j)
                    || rows.contains(j) && columns.contains(i);
            }
        };
        let any = |Range { start, end }: Range<usize>| {
            wanted[start..end.min(wanted.len())].iter().any(|&w| w)
        };
        any(rows.range()) || any(columns.range())
    }

    /// Number of pairs of `count` patches that are wanted, with those that are traced together with
    /// them.
    pub fn pairs(self, count: usize) -> u64 {
        let (mut after, mut sum) = (0, 0);
        for at in (0..count).rev() {
            let all = match self {
                Self::All => true,
                Self::Rows(wanted) | Self::Sample(wanted) => wanted[at],
                Self::Pair(_) => false,
            };
            sum += if all { (count - 1 - at) as u64 } else { after };
            after += u64::from(self.has(Places::new(at..at), Places::new(at..at + 1)));
        }
        sum
    }
}
