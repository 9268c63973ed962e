//! One descriptor for each parameter.
//!
//! A phenomenon lists its parameters once, with [`parameters!`](crate::parameters!): type, default, range, unit and
//! documentation. Parser, located errors, schema, book, inspector and random scenes all read that one list.

pub mod animated;
mod assets;
mod descriptor;
mod keyed;
mod macros;
mod model_error;
pub mod parameter_error;
mod problem;
mod reader;
mod sample;
mod types;
mod value;

pub use assets::assets;
pub use descriptor::{Choice, Descriptor, Kind, TableDescriptor};
pub use keyed::{CurveLimits, InterpolationName, MAX_POINTS};
pub use model_error::ModelError;
pub use problem::{Problem, ProblemKind, nearest};
pub use reader::{MAX_PROBLEMS, Problems, Reader};
pub use sample::sample;
pub use types::{AssetPath, Auto, Length, Parameter, Parameters, Range, path};
pub use value::{Entry, Node, Span, Table, Value};
