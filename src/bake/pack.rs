//! Rectangles in an atlas.

/// Texels between the texels of two charts, and around the atlas, are twice this.
pub(super) const GUTTER: usize = 1;

/// Of the area of all rectangles the square is first tried so much larger.
const SLACK: f64 = 1.1;

/// Where each of some rectangles (texels across and down, gutters apart) lies in a square-like
/// atlas, and the atlas's size.
pub(super) fn pack(sizes: &[[usize; 2]]) -> (Vec<[usize; 2]>, [usize; 2]) {
    let outer = |s: &[usize; 2]| s.map(|n| n + 2 * GUTTER);
    let area: usize = sizes.iter().map(|s| outer(s).iter().product::<usize>()).sum();
    let widest = sizes.iter().map(|s| outer(s)[0]).max().unwrap_or(1);
    let width = ((area as f64 * SLACK).sqrt() as usize).max(widest).next_multiple_of(4);
    // Shelves of falling height.
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(sizes[i][1]), std::cmp::Reverse(sizes[i][0]), i));
    let mut places = vec![[0, 0]; sizes.len()];
    let (mut shelf, mut next, mut right) = (0, 0, 0);
    for i in order {
        let [w, h] = outer(&sizes[i]);
        if right + w > width || next == 0 {
            (shelf, right) = (next, 0);
            next += h;
        }
        places[i] = [right + GUTTER, shelf + GUTTER];
        right += w;
    }
    (places, [width, next.max(1).next_multiple_of(4)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_lie_apart_and_within() {
        let sizes: Vec<[usize; 2]> = (1..60).map(|i| [1 + i * 7 % 23, 1 + i * 5 % 17]).collect();
        let (places, [width, height]) = pack(&sizes);
        let mut taken = vec![false; width * height];
        for (size, place) in sizes.iter().zip(&places) {
            for y in place[1] - GUTTER..place[1] + size[1] + GUTTER {
                for x in place[0] - GUTTER..place[0] + size[0] + GUTTER {
                    assert!(!std::mem::replace(&mut taken[y * width + x], true));
                }
            }
        }
        let used = taken.iter().filter(|t| **t).count();
        assert!(used * 10 > width * height * 7, "{used} of {}", width * height);
    }
}
