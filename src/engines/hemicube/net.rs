//! The item buffer of a hemicube laid flat, as the paper draws it.

use super::model::{BACK, Model, RowBuffers};
use crate::patches::PatchId;
use crate::visibility::{NOTHING, back, each_face};

/// What a pixel of a hemicube sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// The patch that is drawn there.
    Patch(PatchId),
    /// A side that exchanges no light.
    Back,
    /// The surroundings.
    Environment,
}

/// The five faces of a hemicube laid flat: the top in the middle of a square, a side face beside
/// each of its edges.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Net {
    /// Pixels across and down: twice those of the top.
    pub size: usize,
    /// What each pixel sees, row by row; `None` in the corners of the square.
    pub pixels: Vec<Option<Item>>,
}

/// Lays flat what is in the item buffers, which are of patches.
pub(super) fn net(model: &Model<'_>, buffers: &RowBuffers) -> Net {
    let size = 2 * model.faces[0].width();
    let mut pixels = vec![None; size * size];
    each_face!(F => {
        let face = &model.faces[F];
        let rows = buffers.items[F].items().chunks(face.stride()).zip(face.y());
        for (items, &y) in rows {
            for (&item, &x) in items[..face.width()].iter().zip(face.x()) {
                let local = back::<F>([x, y, 1.0]);
                // Beyond an edge of the top, sides go on from z = 1 to 0.
                let beyond = |along: f32, other: f32| match F {
                    0 => along,
                    _ if along.abs() > other.abs() => along.signum() * (2.0 - local.z),
                    _ => along,
                };
                let at = [beyond(local.x, local.y), beyond(local.y, local.x)];
                let [column, row] = at.map(|c| ((c + 2.0) / 4.0 * size as f32) as usize);
                pixels[row.min(size - 1) * size + column.min(size - 1)] = Some(match item {
                    NOTHING => Item::Environment,
                    BACK => Item::Back,
                    patch => Item::Patch(PatchId(patch)),
                });
            }
        }
    });
    Net { size, pixels }
}
