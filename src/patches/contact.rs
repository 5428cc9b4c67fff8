//! Contact lines: where a surface stands on, or passes through, a side of a source triangle.
//!
//! Beyond such a line lies another room: what happens there says nothing about this side of it. A
//! patch that a line passes through would carry light from one room to the other; so a point of a
//! patch that does not see the patch's centre along the surface belongs to a neighbour that it
//! does see.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::line::Line;
use super::touching;
use crate::progress::{Cancelled, Progress};
use crate::scene::box_tree::{Bounds, BoxTree};
use crate::scene::shares::Shared;
use crate::scene::{Geometry, TriangleId};

/// The contact lines of all sides.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactLines {
    starts: Vec<u32>,
    lines: Vec<Line>,
    /// For each side the edges that something stands on: bit k for that from corner k to the next.
    edges: Vec<u8>,
    /// The lines of sides that have many.
    trees: HashMap<usize, BoxTree>,
    /// Triangles that touch or cross so many others that not all of those were tried.
    pub unfinished: usize,
}

/// Fewer lines than this need no tree.
const MANY: usize = 16;

impl ContactLines {
    pub fn find(geometry: &Geometry, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let solid: Vec<TriangleId> = geometry.ids().filter(|&t| geometry.is_solid(t)).collect();
        let Shared { found, unfinished, .. } = touching::contacts(geometry, &solid, progress)?;
        let mut found = solid.iter().zip(found).peekable();
        let mut me = Self { starts: vec![0], unfinished, ..Self::default() };
        for t in geometry.ids() {
            let own = found.next_if(|f| *f.0 == t).map_or_else(Default::default, |f| f.1);
            for side in own {
                if side.lines.len() >= MANY {
                    let boxes: Vec<Bounds> = side.lines.iter().map(bounds).collect();
                    me.trees.insert(me.edges.len(), BoxTree::new(&boxes));
                }
                me.lines.extend(side.lines);
                me.starts.push(me.lines.len() as u32);
                me.edges.push(side.edges);
            }
        }
        Ok(me)
    }

    /// Whether another triangle, which does not have this edge too, stands on edge `k` of a side.
    pub fn on_edge(&self, side: usize, k: u8) -> bool {
        self.edges[side] >> k & 1 == 1
    }

    /// Whether there are any on one side.
    pub fn any_on(&self, side: usize) -> bool {
        self.starts[side] < self.starts[side + 1]
    }

    /// Both ends of each line on one side, in the coordinates `uv` of the source triangle.
    pub fn on(&self, side: usize) -> impl ExactSizeIterator<Item = [DVec2; 2]> + '_ {
        let range = self.starts[side] as usize..self.starts[side + 1] as usize;
        self.lines[range].iter().map(|line| [line.from, line.to])
    }

    /// Whether `test` holds for any line on one side that may come within a box.
    pub(super) fn any(
        &self,
        side: usize,
        [low, high]: [DVec2; 2],
        mut test: impl FnMut(&Line) -> bool,
    ) -> bool {
        let lines = &self.lines[self.starts[side] as usize..self.starts[side + 1] as usize];
        let Some(tree) = self.trees.get(&side) else { return lines.iter().any(test) };
        let outside = |from: DVec3, to: DVec3| {
            from.truncate().cmpgt(high).any() || to.truncate().cmplt(low).any()
        };
        !tree.near_while(outside, |i| !test(&lines[i as usize]))
    }

    /// The lines on one side for which `test` holds, of those that may come within a box.
    pub(super) fn all(
        &self,
        side: usize,
        within: [DVec2; 2],
        test: impl Fn(&Line) -> bool,
    ) -> Vec<Line> {
        let mut found = Vec::new();
        self.any(side, within, |line| {
            found.extend(test(line).then_some(*line));
            false
        });
        found
    }
}

fn bounds(line: &Line) -> Bounds {
    (line.from.min(line.to).extend(0.0), line.from.max(line.to).extend(0.0))
}

#[cfg(test)]
mod tests {
    use super::super::line::Plane;
    use super::super::point::side_index;
    use super::*;
    use crate::progress::Silent;
    use crate::scene::{Material, SceneBuilder, Side, Sides};

    #[test]
    fn a_wall_parts_the_floor_it_stands_on_and_only_its_upper_side() {
        let mut b = SceneBuilder::new("wall");
        let m = b.material(Material::default());
        let vertices = [
            DVec3::new(-2.0, 0.0, -2.0),
            DVec3::new(-2.0, 0.0, 6.0),
            DVec3::new(6.0, 0.0, -2.0),
            DVec3::new(0.5, 0.0, -1.0),
            DVec3::new(0.5, 0.0, 1.0),
            DVec3::new(0.5, 2.0, 0.0),
        ];
        b.mesh("floor and wall", &vertices, &[[0, 1, 2], [3, 4, 5]], m, Sides::Two);
        let g = b.finish().geometry;
        let lines = ContactLines::find(&g, &Silent).unwrap();
        let floor = TriangleId(0);
        let everywhere = [DVec2::NEG_INFINITY, DVec2::INFINITY];
        let upper = lines.all(side_index(floor, Side::Front), everywhere, |_| true);
        let [upper] = upper[..] else { panic!("one line") };
        assert!(!lines.any_on(side_index(floor, Side::Back)));
        assert!(!lines.any_on(2) && !lines.any_on(3), "the wall's foot is its edge");
        let plane = Plane::of(g.corners(floor));
        let at = |x: f64, z: f64| plane.uv(DVec3::new(x, 0.0, z));
        assert!(upper.separates(at(0.0, 0.0), at(1.0, 0.0)));
        assert!(!upper.separates(at(0.0, 0.0), at(0.4, 0.5)));
        assert!(!upper.separates(at(0.0, 1.5), at(1.0, 1.5)), "past the wall's end");
        assert!(!upper.separates(at(0.5, 0.0), at(1.0, 0.0)), "from its foot");
    }
}
