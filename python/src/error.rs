//! Errors of the library as exceptions: the words of the program, and of scenes the place of each problem.

use bansho::{
    BuildErrors, EffectError, LoopError, ParameterProblems, PlanError, RenderError, SceneError,
    base::parameters::{Problem, ProblemKind},
    job::{ErrorCategory, JobError},
    scene::edit::EditError,
};
use pyo3::{
    exceptions::{PyKeyboardInterrupt, PyOSError, PyRuntimeError, PyValueError},
    prelude::*,
    types::PyDict,
};

/// The exception for a value that is not possible.
pub(crate) fn value(message: String) -> PyErr {
    PyValueError::new_err(message)
}

/// The exception for a fault of Bansho itself.
pub(crate) fn internal(message: String) -> PyErr {
    Python::attach(|py| match exception(py, "InternalError").and_then(|class| class.call1((message.clone(),))) {
        Ok(raised) => PyErr::from_value(raised),
        Err(_) => PyRuntimeError::new_err(message),
    })
}

/// A class of the module `bansho.errors`.
fn exception<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("bansho.errors")?.getattr(name)
}

/// An exception `SceneError` with a message and its problems, each a dictionary.
fn scene_exception(message: &str, problems: impl IntoIterator<Item = ProblemEntry>) -> PyErr {
    Python::attach(|py| {
        let listed: PyResult<Vec<Bound<PyDict>>> =
            problems.into_iter().map(|problem| problem.into_dictionary(py)).collect();
        let raised = listed.and_then(|listed| exception(py, "SceneError")?.call1((message, listed)));
        raised.map_or_else(|error| error, PyErr::from_value)
    })
}

/// A problem as Python sees it.
struct ProblemEntry {
    line: Option<usize>,
    column: Option<usize>,
    key: String,
    message: String,
    allowed: Option<String>,
    choices: Vec<String>,
}

impl ProblemEntry {
    fn new(problem: &Problem, position: Option<[usize; 2]>) -> Self {
        let key = match &problem.kind {
            ProblemKind::UnknownKey { key, .. } if problem.path.is_empty() => key.clone(),
            ProblemKind::UnknownKey { key, .. } => format!("{}.{key}", problem.path),
            _ => problem.path.clone(),
        };
        let choices = match &problem.kind {
            ProblemKind::UnknownKey { allowed, .. } | ProblemKind::NotOneOf { allowed, .. } => allowed.clone(),
            _ => Vec::new(),
        };
        let message = problem.to_string();
        Self {
            line: position.map(|[line, _]| line),
            column: position.map(|[_, column]| column),
            key,
            allowed: allowed_of(&problem.kind),
            message,
            choices,
        }
    }

    fn into_dictionary(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dictionary = PyDict::new(py);
        dictionary.set_item("line", self.line)?;
        dictionary.set_item("column", self.column)?;
        dictionary.set_item("key", self.key)?;
        dictionary.set_item("message", self.message)?;
        dictionary.set_item("allowed", self.allowed)?;
        dictionary.set_item("choices", self.choices)?;
        Ok(dictionary)
    }
}

/// What is allowed instead, in the words of the message.
fn allowed_of(kind: &ProblemKind) -> Option<String> {
    if let ProblemKind::WrongType { expected, .. } = kind {
        return Some(expected.clone());
    }
    let message = kind.to_string();
    let (_, allowed) = message.split_once("allowed: ")?;
    Some(allowed.to_owned())
}

/// The exception for an invalid scene, whose text has lines.
pub(crate) fn scene(error: &SceneError) -> PyErr {
    scene_with_message(error, &error.to_string())
}

/// The exception for an invalid scene, with a message that may also name a frame.
fn scene_with_message(error: &SceneError, message: &str) -> PyErr {
    let mut entries = Vec::with_capacity(error.problems.len());
    for problem in &error.problems {
        let position = problem.span.as_ref().map(|span| error.position(span.start));
        entries.push(ProblemEntry::new(problem, position.map(|position| [position.line, position.column])));
    }
    scene_exception(message, entries)
}

/// The exception for parameters that a program has set.
pub(crate) fn parameters(problems: &ParameterProblems) -> PyErr {
    let entries: Vec<ProblemEntry> = problems.0.listed.iter().map(|problem| ProblemEntry::new(problem, None)).collect();
    scene_exception(&problems.to_string(), entries)
}

/// The exception for a change of a scene that is refused.
pub(crate) fn edit(error: &EditError) -> PyErr {
    let key = match error {
        EditError::NoSuchPath { path, .. } | EditError::NoKeyframe { path, .. } => path.clone(),
        _ => String::new(),
    };
    let (allowed, choices) = match error {
        EditError::NoSuchPath { available, suggestions, .. } => (Some(available.clone()), suggestions.clone()),
        _ => (None, Vec::new()),
    };
    let message = error.to_string();
    scene_exception(&message.clone(), [ProblemEntry { line: None, column: None, key, message, allowed, choices }])
}

/// The exception for what only building finds, of a scene without text.
fn build(errors: &BuildErrors) -> PyErr {
    let mut entries = Vec::with_capacity(errors.0.len());
    for (path, error) in &errors.0 {
        let problem = Problem { span: None, path: format!("{path}.{}", error.key), kind: error.kind.clone() };
        entries.push(ProblemEntry::new(&problem, None));
    }
    scene_exception(&errors.to_string(), entries)
}

/// The exception for a shot that cannot be planned.
pub(crate) fn plan(error: &PlanError) -> PyErr {
    value(error.to_string())
}

/// The exception for a scene that cannot loop.
pub(crate) fn looping(error: &LoopError) -> PyErr {
    value(error.to_string())
}

/// The exception for a frame that cannot be drawn.
pub(crate) fn render(error: &RenderError) -> PyErr {
    match error {
        RenderError::Cancelled(_) => PyKeyboardInterrupt::new_err(error.to_string()),
        RenderError::Plate(plate) => build(&BuildErrors(vec![("plate".to_owned(), plate.as_ref().clone())])),
        RenderError::Snapshot(_) | RenderError::ForeignSnapshot => value(error.to_string()),
    }
}

/// The exception for an effect that cannot be opened, changed or drawn.
pub(crate) fn effect(error: &EffectError) -> PyErr {
    match error {
        EffectError::Parameters(problems) => parameters(problems),
        EffectError::Build(errors) => build(errors),
        EffectError::Render(error) => render(error),
        other => value(other.to_string()),
    }
}

/// The exception for a job that failed.
pub(crate) fn job(error: &JobError) -> PyErr {
    match (error, error.scene(), error.category()) {
        (_, Some(problems), _) => scene_with_message(problems, &error.to_string()),
        (JobError::Edit { source, .. }, ..) => edit(source),
        (.., ErrorCategory::Cancelled) => PyKeyboardInterrupt::new_err(error.to_string()),
        (.., ErrorCategory::Usage) => value(error.to_string()),
        (.., ErrorCategory::Scene | ErrorCategory::Work) => PyOSError::new_err(error.to_string()),
    }
}
