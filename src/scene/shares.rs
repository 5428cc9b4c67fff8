//! Work that is shared out among things, most of which need little of it.

use rayon::prelude::*;

/// What was found around one of many things.
#[derive(Debug)]
pub(crate) struct Looked<T> {
    pub found: T,
    /// How many others were tried.
    pub tried: usize,
    /// Whether that was all there are.
    pub all: bool,
}

/// What was found around all of many things.
#[derive(Debug)]
pub(crate) struct Shared<T> {
    pub found: Vec<T>,
    /// How many others were tried in all.
    #[cfg_attr(not(test), expect(dead_code))]
    pub tried: usize,
    /// Around how many things not all others were tried.
    pub unfinished: usize,
}

/// Calls `look(i, most)` for `n` things: around thing `i`, about `most` others may be tried. It is
/// called again with a larger `most` for those that are not done by then, as long as all together
/// try no more than `each` others on the average, about. An error of `look` ends it.
///
/// So a few things may have very many others around them, as a floor has; only where most things
/// do, as where all cross each other, not all are tried, and work does not grow as n².
pub(crate) fn share_out<T: Send + Default, E: Send>(
    n: usize,
    each: usize,
    look: impl Fn(usize, usize) -> Result<Looked<T>, E> + Sync,
) -> Result<Shared<T>, E> {
    /// A thing that was not done is given so many times as much, at most.
    const MORE: usize = 16;
    let mut found: Vec<T> = Vec::new();
    found.resize_with(n, T::default);
    let mut open: Vec<usize> = (0..n).collect();
    let (mut tried, mut most) = (0, each / 2);
    while !open.is_empty() {
        let looked: Result<Vec<Looked<T>>, E> = open.par_iter().map(|&i| look(i, most)).collect();
        let mut unfinished = Vec::new();
        for (i, looked) in open.into_iter().zip(looked?) {
            tried += looked.tried;
            found[i] = looked.found;
            unfinished.extend((!looked.all).then_some(i));
        }
        open = unfinished;
        let share = (each * n).saturating_sub(tried) / open.len().max(1);
        if share < 2 * most {
            break;
        }
        most = share.min(MORE * most);
    }
    Ok(Shared { found, tried, unfinished: open.len() })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// Work where thing `i` has `others(i)` around it, and how many things are not done.
    fn work(n: usize, others: impl Fn(usize) -> usize + Sync) -> (usize, usize) {
        let look = |i, most| {
            let tried = others(i).min(most);
            Ok::<_, Infallible>(Looked { found: tried, tried, all: tried == others(i) })
        };
        let Ok(Shared { found, tried, unfinished }) = share_out(n, 100, look);
        assert_eq!(unfinished, (0..n).filter(|&i| found[i] < others(i)).count());
        (tried, unfinished)
    }

    #[test]
    fn a_few_may_have_much_around_them_and_all_together_may_not() {
        assert_eq!(work(1000, |_| 50), (50_000, 0));
        let (tried, missing) = work(1000, |i| if i < 2 { 20_000 } else { 20 });
        assert!(missing == 0 && tried < 100_000, "{tried} {missing}");
        for n in [1000, 4000] {
            let (tried, missing) = work(n, |_| n);
            assert!(missing == n && tried <= 100 * n, "{tried} {missing}");
        }
    }
}
