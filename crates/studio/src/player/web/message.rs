//! Messages between page and worker as JavaScript arrays (structured clone).

use std::sync::Arc;

use bansho::Assets;

use super::pending::Reply;
use crate::{
    document::{PhenomenonId, ReportedProblem, Revision},
    player::{FrameRequest, Picture},
};
use js_sys::{Array, Uint8Array};
use wasm_bindgen::{JsCast, JsValue};

/// A message from the page to the worker.
pub(super) enum PageMessage {
    /// An added file.
    File { name: String, bytes: Vec<u8> },
    /// A frame request with its serial number.
    Request { number: u64, request: FrameRequest },
}

impl PageMessage {
    pub(super) fn file(name: &str, bytes: &[u8]) -> Array {
        array(["file".into(), name.into(), Uint8Array::from(bytes).into()])
    }

    pub(super) fn request(number: u64, request: &FrameRequest) -> Array {
        let frame = request.number.map_or(JsValue::NULL, |frame| (frame as f64).into());
        let [width, height] = request.within.map(|side| JsValue::from(side as f64));
        let flags = [request.exact, request.draft, request.full_quality].map(JsValue::from);
        let head = [
            JsValue::from("request"),
            count(number),
            count(request.revision.0),
            (&*request.name).into(),
            (&*request.text).into(),
        ];
        let stages = match request.stages {
            Some(PhenomenonId { kind, index }) => [kind.into(), (index as f64).into()],
            None => [JsValue::NULL; 2],
        };
        head.into_iter().chain([frame, width, height]).chain(flags).chain(stages).collect()
    }

    /// Reads a message. Requests get `assets` as the source of their files.
    pub(super) fn read(message: &JsValue, assets: &Arc<dyn Assets>) -> Option<Self> {
        let mut fields = Fields::of(message)?;
        Some(match fields.text()?.as_str() {
            "file" => Self::File { name: fields.text()?, bytes: fields.bytes()? },
            "request" => {
                let number = fields.count()?;
                let request = FrameRequest {
                    revision: Revision(fields.count()?),
                    name: fields.text()?,
                    text: fields.text()?.into(),
                    assets: assets.clone(),
                    number: fields.next()?.as_f64().map(|frame| frame as i64),
                    within: fields.size()?,
                    exact: fields.flag()?,
                    draft: fields.flag()?,
                    full_quality: fields.flag()?,
                    stages: fields.phenomenon()?,
                };
                Self::Request { number, request }
            }
            _ => return None,
        })
    }
}

impl Reply {
    pub(super) fn write(self) -> Array {
        match self {
            Self::Ready => array(["ready".into()]),
            Self::Checked { number, report: Ok(ev100) } => array(["checked".into(), count(number), ev100.into()]),
            Self::Checked { number, report: Err(problems) } => {
                let problems: Array = problems.iter().map(write_problem).collect();
                array(["checked".into(), count(number), problems.into()])
            }
            Self::Drawn { picture } => write_picture("drawn", &picture).collect(),
            Self::Stage { stage, picture } => {
                write_picture("stage", &picture).chain([JsValue::from(stage as f64)]).collect()
            }
            Self::FullQualityFrame { frame, png } => {
                array(["full_quality_frame".into(), (frame as f64).into(), Uint8Array::from(png.as_slice()).into()])
            }
            Self::Failed { number, reason } => array(["failed".into(), count(number), reason.into()]),
            Self::Panicked { number, message } => array(["panicked".into(), count(number), message.into()]),
            Self::Done { number } => array(["done".into(), count(number)]),
        }
    }

    pub(super) fn read(message: &JsValue) -> Option<Self> {
        let mut fields = Fields::of(message)?;
        Some(match fields.text()?.as_str() {
            "ready" => Self::Ready,
            "checked" => {
                let number = fields.count()?;
                let report = fields.next()?;
                let problems =
                    || report.dyn_ref::<Array>().into_iter().flat_map(Array::iter).filter_map(read_problem).collect();
                Self::Checked { number, report: report.as_f64().map(|ev100| ev100 as f32).ok_or_else(problems) }
            }
            "drawn" => Self::Drawn { picture: fields.picture()? },
            "stage" => {
                let picture = fields.picture()?;
                Self::Stage { stage: fields.number()? as usize, picture }
            }
            "full_quality_frame" => Self::FullQualityFrame { frame: fields.number()? as i64, png: fields.bytes()? },
            "failed" => Self::Failed { number: fields.count()?, reason: fields.text()? },
            "panicked" => Self::Panicked { number: fields.count()?, message: fields.text()? },
            "done" => Self::Done { number: fields.count()? },
            _ => return None,
        })
    }
}

fn array<const N: usize>(fields: [JsValue; N]) -> Array {
    fields.into_iter().collect()
}

/// A problem as an array. Without a span, both of its ends are null.
fn write_problem(problem: &ReportedProblem) -> Array {
    let [start, stop] = match &problem.span {
        Some(span) => [span.start, span.end].map(|at| (at as f64).into()),
        None => [JsValue::NULL; 2],
    };
    let asset = problem.asset.as_deref().map_or(JsValue::NULL, JsValue::from);
    array([start, stop, (&*problem.path).into(), (&*problem.reason).into(), asset])
}

fn read_problem(message: JsValue) -> Option<ReportedProblem> {
    let mut fields = Fields::of(&message)?;
    let [start, stop] = [fields.next()?, fields.next()?].map(|end| end.as_f64().map(|at| at as usize));
    let span = start.zip(stop).map(|(start, stop)| start..stop);
    Some(ReportedProblem { span, path: fields.text()?, reason: fields.text()?, asset: fields.next()?.as_string() })
}

/// A serial number. These stay far below 2^53, so that they are exact as JavaScript numbers.
fn count(number: u64) -> JsValue {
    (number as f64).into()
}

fn write_picture(kind: &str, picture: &Picture) -> impl Iterator<Item = JsValue> {
    let Picture { revision, number: frame, size, scene_size, pixels, exact, draft, draw_s, advance_s } = picture;
    let head = [JsValue::from(kind), count(revision.0), (*frame as f64).into()];
    let sizes = [*size, *scene_size].concat().into_iter().map(|side| JsValue::from(side as f64));
    let pixels = Uint8Array::from(pixels.as_flattened());
    let tail = [pixels.into(), (*exact).into(), (*draft).into(), (*draw_s).into(), (*advance_s).into()];
    head.into_iter().chain(sizes).chain(tail)
}

/// The fields of a message, one after another.
struct Fields(std::vec::IntoIter<JsValue>);

impl Fields {
    fn of(message: &JsValue) -> Option<Self> {
        Some(Self(message.dyn_ref::<Array>()?.to_vec().into_iter()))
    }

    fn next(&mut self) -> Option<JsValue> {
        self.0.next()
    }

    fn text(&mut self) -> Option<String> {
        self.next()?.as_string()
    }

    fn number(&mut self) -> Option<f64> {
        self.next()?.as_f64()
    }

    fn count(&mut self) -> Option<u64> {
        self.number().map(|number| number as u64)
    }

    fn flag(&mut self) -> Option<bool> {
        self.next()?.as_bool()
    }

    fn size(&mut self) -> Option<[usize; 2]> {
        Some([self.number()? as usize, self.number()? as usize])
    }

    /// A phenomenon's kind and index; both null for none.
    fn phenomenon(&mut self) -> Option<Option<PhenomenonId>> {
        let (kind, index) = (self.next()?.as_string(), self.next()?.as_f64());
        Some(kind.zip(index).and_then(|(kind, index)| PhenomenonId::find(&kind, index as usize)))
    }

    fn bytes(&mut self) -> Option<Vec<u8>> {
        Some(self.next()?.dyn_into::<Uint8Array>().ok()?.to_vec())
    }

    fn picture(&mut self) -> Option<Picture> {
        let (revision, number) = (Revision(self.count()?), self.number()? as i64);
        let (size, scene_size, bytes) = (self.size()?, self.size()?, self.bytes()?);
        let (pixels, _) = bytes.as_chunks();
        Some(Picture {
            revision,
            number,
            size,
            scene_size,
            pixels: pixels.to_vec(),
            exact: self.flag()?,
            draft: self.flag()?,
            draw_s: self.number()?,
            advance_s: self.number()?,
        })
    }
}
