//! Faults that no single parameter can see by itself.

/// A parameter, or a pair of them, from which no phenomenon can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ParameterError {
    /// The parameter, sub-tables separated by dots, as in `shape.fringe_width`.
    pub key: &'static str,
    /// What is wrong.
    pub kind: ParameterErrorKind,
}

/// What can be wrong with parameters that are each within their own bounds.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ParameterErrorKind {
    /// A curve that must begin at the origin begins elsewhere.
    #[error("must be 0 at x = 0, but is {value}")]
    NotZeroAtOrigin {
        /// Its value at x = 0.
        value: f64,
    },
    /// Core and fringe together are wider than the sheet.
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
        /// The one after it.
        next: f64,
    },
    /// A loop that is no length of time.
    #[error("a loop of {seconds} s; allowed: more than 0")]
    LoopLength {
        /// The length asked for, s.
        seconds: f64,
    },
}
