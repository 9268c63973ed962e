//! Parameters and their descriptors.
//!
//! A phenomenon declares its parameters once, with [`parameters!`](crate::parameters!): type, default, range, unit and
//! documentation. The parser, error locations, the schema, the book, the inspector and random scenes are all derived from that declaration. Parameters
//! that are there only so that a paper can be followed to the letter are marked, and listed last.

pub mod animated;
mod descriptor;
mod keyed;
mod macros;
mod model_error;
mod problem;
mod reader;
mod sample;
mod types;
mod value;

pub use descriptor::{Choice, Descriptor, Kind, PAPER_HEADING, TableDescriptor};
pub use keyed::{CurveLimits, InterpolationName, MAX_POINTS};
pub use model_error::{ModelError, ParameterError, ParameterErrorKind};
pub use problem::{BuildError, Problem, ProblemKind, nearest};
pub use reader::{MAX_PROBLEMS, Problems, Reader};
pub use sample::sample;
pub use types::{AssetPath, Auto, Length, Parameter, Parameters, Range, path};
pub use value::{Entry, Node, Span, Table, Value};
