//! What a frame is drawn as: scene-linear light, or display codes.

use bansho_base::{
    frame::{Frame, FrameHeader, PhenomenonMetadata},
    host::observer::Cancelled,
};

use crate::composite::{background::LightFrame, composition::Composition, light_frame, refraction};

/// What [`Shot::draw`](crate::Shot::draw) draws a frame as: [`SceneLinear`] light, as for EXR files and for buffers of a program, or display codes of 8 or 16 bits
/// by [`DisplayOptions`](crate::display::DisplayOptions), as for PNG files and films. Both have the same pixels: the codes are those of the light.
pub trait Target: Sync + sealed::Sealed {
    /// The type of the frames.
    type Frame: Send;

    /// The frame that the target would have drawn instead of this light. Memory that it does not keep is left in `spare`, for
    /// [`Shot::recycle`](crate::Shot::recycle).
    fn of_light(&self, light: Frame, spare: &mut Option<Frame>) -> Self::Frame;

    /// Draws the whole window, as far as possible in the memory of an earlier frame.
    ///
    /// # Errors
    /// The observer asked to stop.
    #[doc(hidden)]
    fn draw(&self, drawing: Drawing, recycled: &mut Option<Frame>) -> Result<Self::Frame, Cancelled>;
}

/// The target for scene-linear light: a [`Frame`] in ACEScg, with depth, layers, AOVs and metadata as the plan requests them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneLinear;

impl Target for SceneLinear {
    type Frame = Frame;

    fn of_light(&self, light: Frame, _spare: &mut Option<Frame>) -> Frame {
        light
    }

    fn draw(&self, drawing: Drawing, recycled: &mut Option<Frame>) -> Result<Frame, Cancelled> {
        drawing.light(recycled.take())
    }
}

/// The target for light from which glare is computed.
pub(crate) struct WithoutGlare;

impl Target for WithoutGlare {
    type Frame = LightFrame;

    fn of_light(&self, frame: Frame, _spare: &mut Option<Frame>) -> LightFrame {
        LightFrame { frame, drawn: None }
    }

    fn draw(&self, drawing: Drawing, recycled: &mut Option<Frame>) -> Result<LightFrame, Cancelled> {
        drawing.light_frame(recycled.take())
    }
}

/// A frame that is ready to be drawn.
pub struct Drawing<'a> {
    pub(crate) composition: &'a Composition<'a>,
    /// Whether hot air refracts what is behind it.
    pub(crate) is_refracted: bool,
    pub(crate) header: FrameHeader,
    pub(crate) metadata: Vec<PhenomenonMetadata>,
}

impl Drawing<'_> {
    /// Whether the light of the whole picture is needed at once, whatever is kept of it.
    pub(crate) fn needs_light(&self) -> bool {
        self.is_refracted || self.composition.outputs.needs_light()
    }

    /// Draws scene-linear light in the memory of an earlier frame.
    pub(crate) fn light(self, recycled: Option<Frame>) -> Result<Frame, Cancelled> {
        Ok(self.light_frame(recycled)?.frame)
    }

    /// As [`light`](Self::light), with the light that is not the plate's, where it is kept apart.
    fn light_frame(self, recycled: Option<Frame>) -> Result<LightFrame, Cancelled> {
        let draw = if self.is_refracted { refraction::draw_frame } else { light_frame::draw_frame };
        let mut light = draw(self.composition, self.header, recycled)?;
        light.frame.metadata = self.metadata;
        Ok(light)
    }
}

pub(crate) mod sealed {
    /// Keeps [`Target`](super::Target) to the targets of this crate, since only this crate knows what is drawn.
    pub trait Sealed {}

    impl Sealed for super::SceneLinear {}
    impl Sealed for super::WithoutGlare {}
}
