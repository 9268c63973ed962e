//! Why an effect cannot be opened, changed or drawn.

use bansho_render::{BuildErrors, PlanError, RenderError};
use bansho_scene::{LoopError, ParameterProblems};

/// Why an effect cannot be opened, changed or drawn. After an error it is as it was before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EffectError {
    /// Parameters are out of range, not finite, or contradict each other.
    #[error(transparent)]
    Parameters(#[from] ParameterProblems),
    /// What only building finds: parameters that contradict each other, assets that cannot be read.
    #[error(transparent)]
    Build(#[from] BuildErrors),
    /// The size of the picture is not possible.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The scene cannot loop.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// A frame cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A time or a time step that is not possible.
    #[error("{name}: {value} s is out of range; allowed: {min} to {max} s")]
    Time {
        /// What was given: `dt` or `time`.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest possible value.
        min: f64,
        /// Largest possible value.
        max: f64,
    },
    /// A simulation cannot go back in time. [`LiveEffect::restart`](super::LiveEffect::restart) begins again.
    #[error(
        "time: {time} s is too early; simulations have already reached {reached} s; allowed: later times, or `restart`"
    )]
    Backward {
        /// The time that was asked for, s.
        time: f64,
        /// The time that was reached, s.
        reached: f64,
    },
    /// There is no phenomenon of that name.
    #[error("there is no phenomenon `{name}`; allowed: {}", .allowed.join(", "))]
    UnknownName {
        /// The name.
        name: String,
        /// The names of all phenomena.
        allowed: Vec<String>,
    },
    /// The phenomenon is of another kind than the parameters.
    #[error("`{name}` is a {found}; its parameters cannot be those of a {given}")]
    OtherKind {
        /// Name of the phenomenon.
        name: String,
        /// Key of its kind.
        found: &'static str,
        /// Key of the kind of the parameters.
        given: &'static str,
    },
    /// The phenomenon has no gas flow or no position that could be changed.
    #[error("`{name}` is a {kind}, which has no {what} to change")]
    NotChangeable {
        /// Name of the phenomenon.
        name: String,
        /// Key of its kind.
        kind: &'static str,
        /// What it lacks.
        what: &'static str,
    },
    /// The wind cannot be changed.
    #[error(transparent)]
    Wind(#[from] bansho_base::world::wind::WindChangeError),
    /// The length of a loop cannot be changed while it runs.
    #[error("the length of a loop cannot be changed while it runs; allowed: another effect")]
    FixedLoop,
    /// The simulations have not been run up to time 0 yet; see [`Effect::preroll_in_pieces`](super::Effect::preroll_in_pieces).
    #[error("the preroll is not finished ({steps} steps left); call `preroll` until none are left")]
    Preroll {
        /// Steps that are left.
        steps: u64,
    },
}
