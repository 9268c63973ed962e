//! Errors in combinations of parameters.

/// A parameter, or a combination of parameters, that no phenomenon can be built from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ParameterError {
    /// Key of the parameter, with sub-tables separated by dots, as in `shape.fringe_width`.
    pub key: &'static str,
    /// What is wrong.
    pub kind: ParameterErrorKind,
}

/// What is wrong with parameters that are each within their bounds.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ParameterErrorKind {
    /// A curve that must start at the origin starts elsewhere.
    #[error("must be 0 at x = 0, but is {value}")]
    NotZeroAtOrigin {
        /// Its value at x = 0.
        value: f64,
    },
    /// The core and the fringe together are wider than the sheet.
    #[error("together with `shape.core_width` it reaches {sum} at height {at}; allowed: up to 1")]
    WiderThanSheet {
        /// Height w at which they are widest.
        at: f64,
        /// Their sum there.
        sum: f64,
    },
    /// A list that must ascend does not.
    #[error("must ascend, but {next} follows {value}")]
    NotAscending {
        /// A value of the list.
        value: f64,
        /// The next value.
        next: f64,
    },
    /// The length of a loop is not above 0.
    #[error("a loop of {seconds} s; allowed: more than 0")]
    LoopLength {
        /// The requested length, s.
        seconds: f64,
    },
}
