//! A fault that only a model can state, kept as what it is.

use std::{error::Error, fmt, sync::Arc};

/// A model's own error of any type. Two are equal where they say the same.
#[derive(Clone, Debug)]
pub struct ModelError(Arc<dyn Error + Send + Sync>);

impl ModelError {
    /// Keeps `error`.
    pub fn new(error: impl Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }

    /// The error, where it is an `E`.
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
        let fault = ModelError::new(CurveError::Empty);
        assert_eq!(fault.to_string(), CurveError::Empty.to_string());
        assert_eq!(fault.downcast::<CurveError>(), Some(&CurveError::Empty));
        assert!(fault.downcast::<fmt::Error>().is_none());
        assert_eq!((fault == ModelError::new(CurveError::Empty), fault == ModelError::new(fmt::Error)), (true, false));
    }
}
