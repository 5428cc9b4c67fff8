//! Groups whose `g` line stands after their faces instead of before them.
//!
//! By the format, faces belong to the `g` line before them, whatever `usemtl` says. Some files are
//! written the other way round, as the well-known `CornellBox-Original.obj`:
//!
//! ```text
//! usemtl shortBox
//! f …
//! g shortBox
//! usemtl shortBox
//! ```
//!
//! Read to the letter, these faces would be of the group before, and the last such group would have
//! none at all. So a group without faces takes those before it if they have the material of its
//! name. A group that loses all its faces in this way must get its own in the same way; if it does
//! not, the file means what it says, and nothing is moved.

use std::collections::HashSet;
use std::ops::Range;

/// What lies between one `g` or `o` line and the next.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// Line of the statement that opens it; 0 at the beginning of the file.
    pub line: usize,
    pub object: String,
    pub group: String,
    /// Its faces, by index.
    pub faces: Range<usize>,
    /// Where its faces of the last material begin.
    pub last_run: usize,
    /// Name of that material; empty for none.
    pub material: String,
}

/// Faces that the `g` line after them names.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    pub faces: Range<usize>,
    /// The block that the line opens.
    pub block: usize,
}

/// The labels among `blocks`, the last one first.
pub fn labels(blocks: &[Block]) -> Vec<Label> {
    fn name(block: &Block) -> (&str, &str) {
        (&block.object, &block.group)
    }
    let with_faces: HashSet<_> = blocks.iter().filter(|b| !b.faces.is_empty()).map(name).collect();
    let mut found = Vec::new();
    let mut k = blocks.len();
    while k > 1 {
        k -= 1;
        let mut chain = Vec::new();
        if !with_faces.contains(&name(&blocks[k])) && follow(blocks, k, &mut chain) {
            k = k + 1 - chain.len();
            found.append(&mut chain);
        }
    }
    found
}

/// Lets the empty block `k` take the faces before it, and so on as long as that leaves a block
/// empty; whether all such blocks get faces of their own.
fn follow(blocks: &[Block], mut k: usize, chain: &mut Vec<Label>) -> bool {
    while k > 0 {
        let (before, block) = (&blocks[k - 1], &blocks[k]);
        let faces = before.last_run.max(before.faces.start)..before.faces.end;
        let named = !block.group.is_empty() && block.group == before.material;
        if !named || block.object != before.object || faces.is_empty() {
            return false;
        }
        let all = faces == before.faces;
        chain.push(Label { faces, block: k });
        if !all || before.group.is_empty() {
            return true;
        }
        k -= 1;
    }
    false
}
