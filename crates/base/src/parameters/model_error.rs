//! Errors of models in parameters that are each within their bounds.

use std::{error::Error, fmt, sync::Arc};

/// An error of any type from a model. Two are equal if their messages are equal.
#[derive(Clone, Debug)]
pub struct ModelError(Arc<dyn Error + Send + Sync>);

impl ModelError {
    /// Wraps `error`.
    pub fn new(error: impl Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }

    /// The error, if it is of type `E`.
    pub fn downcast<E: Error + 'static>(&self) -> Option<&E> {
        self.0.downcast_ref()
    }
}

impl PartialEq for ModelError {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Error for ModelError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::curve::CurveError;

    #[test]
    fn a_fault_stays_what_it_is() {
        let error = ModelError::new(CurveError::Empty);
        assert_eq!(error.to_string(), CurveError::Empty.to_string());
        assert_eq!(error.downcast::<CurveError>(), Some(&CurveError::Empty));
        assert!(error.downcast::<fmt::Error>().is_none());
        assert_eq!((error == ModelError::new(CurveError::Empty), error == ModelError::new(fmt::Error)), (true, false));
    }
}

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
    /// A value that does not go together with that of another parameter.
    #[error("must be {allowed} where {other}")]
    NotWith {
        /// The value that is allowed.
        allowed: &'static str,
        /// The other parameter and its value.
        other: &'static str,
    },
    /// A file that another parameter requires is not stated.
    #[error("must name a file where {other}")]
    NoFile {
        /// The other parameter and its value.
        other: &'static str,
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
    #[error("a loop of {seconds} s is too short; allowed: more than 0 s")]
    LoopLength {
        /// The requested length, s.
        seconds: f64,
    },
}
