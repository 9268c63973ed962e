//! Edits of an aurora's shapes as operations on the scene's text: draw and smooth strokes, split, merge and link sheets.
//! `bansho::aurora::shapes` validates every edit; its error is shown.

mod changes;
mod links;
pub mod polyline;
mod removal;
mod renumber;
mod sheets;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use bansho::{
    Assets,
    aurora::{
        AuroraParameters,
        shapes::{Sequence, ShapeError},
    },
    base::{
        math::DVec2,
        parameters::{Parameters, ProblemKind, Reader, Table, Value},
    },
    scene::{
        ValuePath,
        edit::EditError,
        operation::{self, Operation},
        parse_values,
    },
};

use crate::document::Document;

pub use changes::StrokeEnd;
pub use links::{LinkedPoint, SheetPosition};
pub use sheets::Factor;

/// The shapes of one aurora of a scene.
#[derive(Clone, Debug)]
pub struct AuroraDrawing {
    path: ValuePath,
    parameters: AuroraParameters,
    sequence: Sequence,
}

/// Why shapes cannot be shown or edited.
#[derive(Debug, thiserror::Error)]
pub enum ShapeEditError {
    /// There is no such aurora.
    #[error("the aurora is not in the scene any more")]
    Missing,
    /// A problem outside of the shapes.
    #[error("{0}")]
    Invalid(String),
    /// Invalid shapes.
    #[error("shape {}: {}", shape_number(.0), .0.kind)]
    Shape(ShapeError),
    /// The text cannot be edited.
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// The 1-based number of the shape with the error.
fn shape_number(error: &ShapeError) -> usize {
    let number = error.key.split('.').nth(1).and_then(|segment| segment.parse::<usize>().ok());
    number.unwrap_or_default() + 1
}

impl AuroraDrawing {
    /// The shapes of aurora `index` of the scene `root`.
    ///
    /// # Errors
    /// There is no such aurora, or its parameters or shapes are invalid.
    pub fn read(root: &Table, index: usize, assets: &Arc<dyn Assets>) -> Result<Self, ShapeEditError> {
        let path = ValuePath::root().key(AuroraParameters::KIND.key).index(index);
        let Some(Value::Table(table)) = path.find(root).map(|node| &node.value) else {
            return Err(ShapeEditError::Missing);
        };
        let mut reader = Reader::new();
        let parameters = AuroraParameters::read_table(table, &mut reader, &[]);
        // The keys that all phenomena have are unknown to this reader.
        let mut problems = reader.into_problems().listed.into_iter();
        if let Some(problem) = problems.find(|problem| !matches!(problem.kind, ProblemKind::UnknownKey { .. })) {
            return Err(ShapeEditError::Invalid(problem.to_string()));
        }
        let AuroraParameters { shapes, morphing, extent_km, .. } = &parameters;
        let sequence =
            Sequence::new(shapes, morphing, *extent_km, assets.as_ref(), None).map_err(ShapeEditError::Shape)?;
        Ok(Self { path, parameters, sequence })
    }

    /// Side of the map, km.
    pub fn extent_km(&self) -> f64 {
        self.parameters.extent_km
    }

    /// Whether the scene states shapes; an aurora without any has default shapes.
    pub fn is_stated(&self) -> bool {
        !self.parameters.shapes.is_empty()
    }

    /// When each shape is reached, s.
    pub fn arrivals(&self) -> &[f64] {
        if self.is_stated() { self.sequence.arrivals() } else { &self.sequence.arrivals()[..1] }
    }

    /// The lines of all sheets of shape `shape`, km.
    pub fn lines(&self, shape: usize) -> Vec<Vec<DVec2>> {
        let time = self.sequence.arrivals().get(shape).copied();
        let sheets = time.map(|time| self.sequence.at(time).sheets).unwrap_or_default();
        sheets.into_iter().map(|sheet| sheet.points).collect()
    }

    /// A factor at each control point of sheet `sheet`.
    pub fn factors(&self, shape: usize, sheet: usize, factor: Factor) -> Vec<f64> {
        let time = self.sequence.arrivals().get(shape).copied().unwrap_or_default();
        let sheet = self.sequence.at(time).sheets.into_iter().nth(sheet).unwrap_or_default();
        match factor {
            Factor::Flux => sheet.flux,
            Factor::Energy => sheet.energy,
        }
    }

    /// The segments of the previous shape that become sheet `sheet` of shape `shape`.
    pub fn origins(&self, shape: usize, sheet: usize) -> Vec<Vec<DVec2>> {
        let all = self.lines(shape);
        let mut strands = shape.checked_sub(1).map(|before| self.point_paths(before)).unwrap_or_default();
        // The middle of a strand says where it arrives: its ends may be those of two sheets.
        strands.retain(|point_paths| {
            let Some([_, middle]) = point_paths.get(point_paths.len() / 2) else { return false };
            polyline::nearest_among(&all, *middle).is_some_and(|(nearest, _)| nearest == sheet)
        });
        strands.iter().map(|point_paths| point_paths.iter().map(|point_path| point_path[0]).collect()).collect()
    }

    /// The paths of the points of shape `shape` to the next one, km, by strand: start and end.
    pub fn point_paths(&self, shape: usize) -> Vec<Vec<[DVec2; 2]>> {
        self.sequence.control_point_paths(shape)
    }
}

impl Document {
    /// Applies `operations` as [`edit`](Self::edit) does, if the resulting shapes of aurora `index` are valid.
    ///
    /// # Errors
    /// They are invalid; nothing is changed then.
    pub fn edit_shapes(
        &mut self,
        label: &str,
        operations: &[Operation],
        index: usize,
        assets: &Arc<dyn Assets>,
    ) -> Result<AuroraDrawing, ShapeEditError> {
        let text = operation::apply(self.text(), operations)?;
        let root = parse_values(&text).map_err(|problem| ShapeEditError::Invalid(problem.to_string()))?;
        let drawing = AuroraDrawing::read(&root, index, assets)?;
        self.apply_text(label, text, root);
        Ok(drawing)
    }
}
