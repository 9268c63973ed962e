//! An error of a model, type-erased.

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
