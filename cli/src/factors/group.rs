//! What `--group` lumps rows by, and whether a model has the names for it.

use hemicube::scene::{GroupBy, Scene};

use crate::args::GroupArg;

impl GroupArg {
    /// As the library has it, and as users know it.
    pub fn by(self) -> (GroupBy, &'static str) {
        match self {
            Self::Surface => (GroupBy::Surface, "surface"),
            Self::Material => (GroupBy::Material, "material"),
            Self::Object => (GroupBy::Object, "object"),
        }
    }
}

/// What to say if all of a model is one group: another grouping that would part it, if one does.
pub fn of_one_group(scene: &Scene, group: GroupArg) -> Option<String> {
    let names = |group: GroupArg| scene.grouping(group.by().0).names;
    let own = names(group);
    let [name] = &own[..] else { return None };
    let kind = group.by().1;
    let others = [GroupArg::Surface, GroupArg::Material, GroupArg::Object].into_iter();
    let best = others.map(|g| (names(g).len(), g.by().1)).max_by_key(|other| other.0);
    let instead = match best.filter(|other| other.0 > 1) {
        Some((groups, other)) => format!("--group {other} makes {groups} groups"),
        None => "without --group every face has a row".to_owned(),
    };
    Some(format!(
        "--group {kind}: the model has one {kind} only ({name}), so all of it is one group; \
         {instead}"
    ))
}
