//! What is said of contacts that are left out.

use super::mesh::Patches;
use crate::progress::Progress;

/// Tells the caller of contacts that may be left out.
pub(crate) fn warn_of_contacts(patches: &Patches, progress: &dyn Progress) {
    let count = patches.contacts_left_out();
    if count > 0 {
        let all = patches.splits().len() / 2;
        progress.warn(&format!(
            "{count} of {all} triangles touch or cross so many others that not all of these \
             contacts are known; light and shade may leak past them; leave out faces that lie \
             inside of others, or join them to one surface"
        ));
    }
}
