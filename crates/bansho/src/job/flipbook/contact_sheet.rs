//! Contact sheets: many frames in one picture, to judge a motion at a glance. They are opaque, since many programs in which they are looked at
//! leave alpha out, and each frame bears its number.

use bansho_base::{
    color::View,
    frame::{DisplayImage, Frame},
    host::observer::{Observer, Stage, StageGuard},
};
use bansho_media::{
    imageops::{
        label,
        sprite_sheet::{SheetLayout, tile_display},
    },
    output::sink::{FrameSlot, Picture},
};
use bansho_render::Shot;

use super::tiles::Gather;
use crate::job::{
    error::JobError,
    observer::JobObserver,
    render::{draw_frames::draw_frames, prepare::PreparedJob},
};

bansho_base::choice! {
    /// What the frames of a contact sheet are laid over.
    pub enum ContactBackground {
        /// Black: the light of the phenomena alone.
        Black = "black",
        /// Squares of two grays, which show what hides the background.
        Checkerboard = "checkerboard",
    }
}

/// Pixels between the frames of a contact sheet.
pub(crate) const GUTTER: usize = 2;
/// What shows between frames and where the last row is not full: a gray that can be told from black.
const FILL: [u8; 4] = [38, 38, 38, u8::MAX];
/// Side of the squares of a checkerboard, pixels.
const SQUARE: usize = 8;
/// The display light of its squares: that of the sRGB codes 64 and 96. Light is added to it, so it is dark.
const SQUARES: [f32; 2] = [0.051_269_46, 0.116_970_67];

/// Draws all frames of `job` into one picture and writes it.
pub(crate) fn run(job: &PreparedJob, sheet: &SheetLayout, observer: &dyn JobObserver) -> Result<(), JobError> {
    let sink = job.format.open(&job.plan, 1, sheet.size(), 1)?;
    let show = |frame: &mut Frame, observer: &dyn Observer| {
        lay_over(frame, job.contact_background, &job.format.view);
        numbered(job.format.show(frame, observer), frame.header.number)
    };
    let gather = Gather::new(sheet.count, observer, show);
    let mut shot = Shot::open(job.compiled.clone(), job.plan.clone());
    draw_frames(&mut shot, &job.frames, &job.snapshots, &gather, observer)?;
    let _stage = StageGuard::begin(observer, Stage::Write);
    let picture = tile_display(&gather.into_tiles(), sheet.columns, sheet.gutter, FILL)?;
    sink.write(FrameSlot { index: 0, number: job.frames[0] }, Picture::Display(&picture, &own_fingerprint(job)))?;
    Ok(sink.finish()?)
}

/// Lays a frame over the background, in light: premultiplied light is what is added to what shows through. A frame over a plate stays as it is.
fn lay_over(frame: &mut Frame, background: ContactBackground, view: &View) {
    if background == ContactBackground::Checkerboard && !frame.opaque {
        let view = view.with_white_balance(frame.header.white_balance_k.map(f64::from));
        let squares = SQUARES.map(|light| view.to_scene([light; 3]));
        let width = frame.beauty.width();
        for (index, pixel) in frame.beauty.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (index % width, index / width);
            let through = 1.0 - pixel[3].clamp(0.0, 1.0);
            let square = squares[(x / SQUARE + y / SQUARE) % 2];
            (0..3).for_each(|channel| pixel[channel] += through * square[channel]);
            pixel[3] = 1.0;
        }
    }
    frame.opaque = true;
}

/// A tile that bears the number of its frame.
fn numbered(mut tile: DisplayImage, number: i64) -> DisplayImage {
    label::draw_number(&mut tile, number);
    tile
}

/// A fingerprint that no single frame has.
fn own_fingerprint(job: &PreparedJob) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for &number in &job.frames {
        hasher.update(&job.plan.frame_fingerprint(number, job.compiled.assets().as_ref()));
    }
    hasher.update(job.contact_background.name().as_bytes());
    job.format.fingerprint(*hasher.update(b"contact sheet").finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        color::{self, AlphaConvention},
        frame::DisplayPixels,
        image::{Image, Rect},
    };
    use bansho_render::display::{BitDepth, display};

    use super::*;
    use crate::job::testing;

    /// Codes of 16 bits of one row of premultiplied light over a background.
    fn shown(
        light: &[[f32; 4]],
        opaque: bool,
        background: ContactBackground,
        view: &View,
        kelvin: Option<f32>,
    ) -> Vec<[u16; 4]> {
        let mut frame = testing::blank(&testing::plan(), 0);
        frame.header.white_balance_k = kelvin;
        frame.beauty = Image::from_pixels(light.len(), 1, light.to_vec()).unwrap();
        // Nothing of it counts as content, as where all is empty.
        frame.content = Rect::from_size(0, 0);
        frame.opaque = opaque;
        lay_over(&mut frame, background, view);
        let picture = display(&frame, view, BitDepth::Sixteen, AlphaConvention::Linear);
        assert!(picture.opaque);
        let DisplayPixels::Sixteen(pixels) = picture.pixels else { panic!("16 bits") };
        pixels
    }

    fn code(light: f32) -> u16 {
        (color::encode_srgb(light) * 65_535.0).round() as u16
    }

    fn is_near(codes: [u16; 4], light: [f32; 3]) {
        let near = codes.iter().zip(light).all(|(&own, light)| own.abs_diff(code(light)) <= 2);
        assert!(near && codes[3] == u16::MAX, "{codes:?} is not {light:?}: {:?}", light.map(code));
    }

    #[test]
    fn over_black_stands_the_light_itself_whatever_it_hides() {
        let light = [[0.0; 4], [0.2, 0.1, 0.05, 0.0], [0.2, 0.1, 0.05, 0.7], [0.0, 0.0, 0.0, 1.0]];
        for view in [View::DISPLAY, View::STANDARD] {
            let codes = shown(&light, false, ContactBackground::Black, &view, None);
            let shown = view.to_display([0.2, 0.1, 0.05]);
            is_near(codes[0], [0.0; 3]);
            is_near(codes[1], shown);
            assert_eq!(codes[1], codes[2], "alpha does not matter over black");
            is_near(codes[3], [0.0; 3]);
        }
    }

    #[test]
    fn over_a_checkerboard_light_is_added_to_what_shows_through() {
        let mut light = vec![[0.0; 4]; 2 * SQUARE];
        light[1] = [0.3, 0.2, 0.1, 0.25];
        light[2] = [0.3, 0.2, 0.1, 1.0];
        light[3] = [0.3, 0.2, 0.1, 0.0];
        for (view, kelvin) in [(View::DISPLAY, None), (View::STANDARD, None), (View::DISPLAY, Some(4000.0))] {
            let codes = shown(&light, false, ContactBackground::Checkerboard, &view, kelvin);
            let view = view.with_white_balance(kelvin.map(f64::from));
            is_near(codes[0], [SQUARES[0]; 3]);
            is_near(codes[SQUARE], [SQUARES[1]; 3]);
            let board = view.to_scene([SQUARES[0]; 3]);
            let over = |through: f32| [0, 1, 2].map(|c| [0.3, 0.2, 0.1][c] + through * board[c]);
            is_near(codes[1], view.to_display(over(0.75)));
            is_near(codes[2], view.to_display(over(0.0)));
            is_near(codes[3], view.to_display(over(1.0)));
        }
        assert_eq!([SQUARES[0], SQUARES[1]].map(code), [64 * 257, 96 * 257]);
    }

    #[test]
    fn a_frame_over_its_plate_has_no_other_background() {
        let plate = [[0.3, 0.2, 0.1, 1.0]];
        let [black, board] = [ContactBackground::Black, ContactBackground::Checkerboard]
            .map(|background| shown(&plate, true, background, &View::DISPLAY, None));
        assert_eq!(black, board);
    }
}
