//! What an aurora's shapes look like, and what hands do to them: strokes drawn and mended, sheets split and merged.
//! Whether a change is possible is for the scene itself to say; a refusal has its words.

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
        shapes::{Sequence, ShapeFault},
    },
    base::{
        math::DVec2,
        parameters::{Parameters, ProblemKind, Reader, Table, Value},
    },
    render::scene::{
        Place,
        edit::EditError,
        operation::{self, Operation},
        values,
    },
};

use crate::document::Document;

pub use changes::SheetEnd;
pub use links::SheetPosition;
pub use sheets::Factor;

/// The drawn shapes of one aurora of a scene.
#[derive(Clone, Debug)]
pub struct AuroraDrawing {
    place: Place,
    parameters: AuroraParameters,
    sequence: Sequence,
}

/// Why shapes cannot be shown, or a change of them is refused.
#[derive(Debug, thiserror::Error)]
pub enum ShapeEditError {
    /// There is no such aurora.
    #[error("the aurora is not in the scene any more")]
    Missing,
    /// Something that is not about shapes.
    #[error("{0}")]
    Faulty(String),
    /// Shapes that an aurora cannot take.
    #[error("shape {}: {}", shape_number(.0), .0.kind)]
    Shape(ShapeFault),
    /// The text cannot be edited.
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// The shape that a fault is about, as a person counts.
fn shape_number(fault: &ShapeFault) -> usize {
    let number = fault.key.split('.').nth(1).and_then(|segment| segment.parse::<usize>().ok());
    number.unwrap_or_default() + 1
}

impl AuroraDrawing {
    /// The shapes of aurora `index` of the scene `root`.
    ///
    /// # Errors
    /// There is no such aurora, or its parameters or shapes are faulty.
    pub fn read(root: &Table, index: usize, assets: &Arc<dyn Assets>) -> Result<Self, ShapeEditError> {
        let place = Place::root().key("aurora").index(index);
        let Some(Value::Table(table)) = place.find(root).map(|node| &node.value) else {
            return Err(ShapeEditError::Missing);
        };
        let mut reader = Reader::new();
        let parameters = AuroraParameters::read_table(table, &mut reader, &[]);
        // Keys that every phenomenon has are not the aurora's own.
        let own = |kind: &ProblemKind| !matches!(kind, ProblemKind::UnknownKey { .. });
        if let Some(problem) = reader.into_problems().listed.into_iter().find(|problem| own(&problem.kind)) {
            return Err(ShapeEditError::Faulty(problem.to_string()));
        }
        let AuroraParameters { shapes, motion, extent_km, .. } = &parameters;
        let sequence =
            Sequence::new(shapes, motion, *extent_km, assets.as_ref(), None).map_err(ShapeEditError::Shape)?;
        Ok(Self { place, parameters, sequence })
    }

    /// Side of the drawn square, km.
    pub fn extent_km(&self) -> f64 {
        self.parameters.extent_km
    }

    /// Whether the scene states shapes; an aurora without any takes some of its own.
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

    /// What sheet `sheet` of shape `shape` comes from: the parts of the shape before that go there.
    pub fn origins(&self, shape: usize, sheet: usize) -> Vec<Vec<DVec2>> {
        let all = self.lines(shape);
        let arrives = |point_paths: &&Vec<[DVec2; 2]>| {
            let Some([_, middle]) = point_paths.get(point_paths.len() / 2) else { return false };
            polyline::nearest_among(&all, *middle).is_some_and(|(own, _)| own == sheet)
        };
        let strands = shape.checked_sub(1).map(|before| self.point_paths(before)).unwrap_or_default();
        strands.iter().filter(arrives).map(|point_paths| point_paths.iter().map(|way| way[0]).collect()).collect()
    }

    /// Where the points of shape `shape` go on the way to the next, km, strand by strand.
    pub fn point_paths(&self, shape: usize) -> Vec<Vec<[DVec2; 2]>> {
        self.sequence.ways(shape)
    }
}

impl Document {
    /// Carries out `operations` as [`edit`](Self::edit) does if aurora `index` can take the shapes that come of them.
    ///
    /// # Errors
    /// It cannot, for the reason given; nothing is changed then.
    pub fn edit_shapes(
        &mut self,
        label: &str,
        operations: &[Operation],
        index: usize,
        assets: &Arc<dyn Assets>,
    ) -> Result<AuroraDrawing, ShapeEditError> {
        let text = operation::apply(self.text(), operations)?;
        let root = values(&text).map_err(|problem| ShapeEditError::Faulty(problem.to_string()))?;
        let drawing = AuroraDrawing::read(&root, index, assets)?;
        self.apply_text(label, text, root);
        Ok(drawing)
    }
}
