//! Which rows are the two sides of one piece of surface.

use super::layout::Layout;
use crate::scene::{Side, TriangleId};

impl Layout {
    /// For each row that of the front of the same piece; its own for a front. Both sides of a
    /// triangle are cut alike, or one of them has a single row.
    #[must_use]
    pub fn fronts(&self) -> Vec<u32> {
        let triangles = self.faces.iter().map(|f| f.triangle.index() + 1).max().unwrap_or(0);
        let mut rows_of: Vec<(usize, usize)> = vec![(0, 0); triangles];
        let mut fronts = Vec::with_capacity(self.faces.len());
        let mut last: Option<(TriangleId, Side)> = None;
        let mut piece = 0;
        for (row, face) in self.faces.iter().enumerate() {
            piece = if last == Some((face.triangle, face.side)) { piece + 1 } else { 0 };
            last = Some((face.triangle, face.side));
            let (first, count) = &mut rows_of[face.triangle.index()];
            if face.side == Side::Front {
                (*first, *count) = (row - *count, *count + 1);
                fronts.push(row as u32);
            } else {
                fronts.push((*first + piece.min(count.saturating_sub(1))) as u32);
            }
        }
        fronts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::Patches;
    use crate::scene::{Scene, SidesChoice};

    #[test]
    fn backs_find_the_fronts_of_their_pieces() {
        let mut scene = Scene::builtin("furnace").unwrap();
        scene.choose_sides(SidesChoice::Two);
        let area = scene.geometry.area(TriangleId(0));
        let patches = Patches::uniform(&scene.geometry, area / 3.0).unwrap();
        let layout = Layout::new(&scene.geometry, &patches);
        let (fronts, half) = (layout.fronts(), layout.len() / 2);
        for i in 0..half {
            assert_eq!([fronts[i], fronts[half + i]], [i as u32; 2]);
            assert_eq!(layout.faces[i].triangle, layout.faces[half + i].triangle);
        }
        assert!(half > scene.geometry.len());
    }
}
