//! One descriptor for each parameter.
//!
//! A phenomenon lists its parameters once, with [`parameters!`](crate::parameters!): type, default, range, unit and
//! documentation. Parser, located errors, schema, book, inspector and random scenes all read that one list.

mod assets;
mod fault;
mod keyed;
mod kind;
mod macros;
mod node;
mod problem;
mod reader;
mod sample;
mod types;

pub use assets::assets;
pub use fault::ModelFault;
pub use keyed::{CurveLimits, InterpolationName, MOST_POINTS};
pub use kind::{Choice, Descriptor, Kind, TableDescriptor};
pub use node::{Entry, Node, Span, Table, Value};
pub use problem::{Problem, ProblemKind, nearest};
pub use reader::{MOST_PROBLEMS, Problems, Reader};
pub use sample::sample;
pub use types::{AssetPath, Auto, Length, Parameter, Parameters, Range, path};
