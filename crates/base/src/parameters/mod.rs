//! One descriptor for each parameter.
//!
//! A phenomenon lists its parameters once, with [`parameters!`](crate::parameters!): type, default, range, unit and
//! documentation. Parser, located errors, schema, book, inspector and random scenes all read that one list.

pub mod animated;
mod assets;
mod descriptor;
mod fault;
mod keyed;
mod macros;
pub mod parameter_fault;
mod problem;
mod reader;
mod sample;
mod types;
mod value;

pub use assets::assets;
pub use descriptor::{Choice, Descriptor, Kind, TableDescriptor};
pub use fault::ModelFault;
pub use keyed::{CurveLimits, InterpolationName, MOST_POINTS};
pub use problem::{Problem, ProblemKind, nearest};
pub use reader::{MOST_PROBLEMS, Problems, Reader};
pub use sample::sample;
pub use types::{AssetPath, Auto, Length, Parameter, Parameters, Range, path};
pub use value::{Entry, Node, Span, Table, Value};
