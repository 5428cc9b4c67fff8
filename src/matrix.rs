//! The matrix of form factors itself, as a result: whole, closed, thinned out, lumped.
//!
//! Row i is face i of the model, whatever the light. [`make`] has a row of every patch made, one
//! entry a pair, drops tiny ones and closes enclosures if that is wanted; [`Lumped`] adds patches
//! up to named groups of them. `export` writes either.

mod assembly;
mod cells;
mod entries;
mod error;
mod forecast;
mod fronts;
mod grey;
mod layout;
mod losses;
mod lumped;
mod make;
mod names;
mod options;
mod plan;
mod report;
mod rows;
mod some_rows;
mod storage;
mod stored;

pub use cells::{RowCells, mean_row};
pub use entries::Matrix;
pub use error::MatrixError;
pub use forecast::Forecast;
pub(crate) use grey::Reflected;
pub use grey::{GreyError, grey};
pub use layout::{Face, Layout};
pub use lumped::{BACK, Lumped};
pub use make::{Choice, make, make_where, merge_where};
pub use options::MatrixOptions;
pub use plan::{Part, Plan};
pub use report::{
    ClosureReport, LossesReport, LostReport, MatrixReport, NamedRow, NpzReport, RowLoss,
    ThresholdReport,
};
pub use rows::{FaceAccount, Precision, Rows, SurfaceRow};
pub use some_rows::make_rows;
pub use storage::RowStore;
pub use stored::{Origin, SameWith, Stored, StoredError, hexadecimal};
