//! Contact sheets: many frames in one picture, to judge a motion at a glance. They are opaque, since many image viewers ignore alpha. Each frame
//! is labeled with its number.

use bansho_base::{
    color::View,
    frame::{DisplayImage, Frame},
    host::observer::Observer,
};
use bansho_media::imageops::{
    label,
    sprite_sheet::{SheetError, SheetLayout, tile_display},
};

use super::output::Format;

bansho_base::choice! {
    /// Background of the frames of a contact sheet.
    pub enum ContactBackground {
        /// Black: only the light of the phenomena.
        Black = "black",
        /// Squares of two grays, which show where a phenomenon hides the background.
        Checkerboard = "checkerboard",
    }
}

/// Pixels between the frames of a contact sheet.
pub(super) const GUTTER: usize = 2;
/// Color between frames and where the last row is not full: a gray that differs visibly from black.
const FILL: [u8; 4] = [38, 38, 38, u8::MAX];
/// Side of the squares of the checkerboard, pixels.
const SQUARE: usize = 8;
/// Linear display values of the two squares, which are the sRGB codes 64 and 96: dark, since light is added to them.
const SQUARES: [f32; 2] = [0.051_269_46, 0.116_970_67];

/// The tile of a frame: over its background, with its number.
pub(crate) fn tile(
    frame: &mut Frame,
    background: ContactBackground,
    format: &Format,
    observer: &dyn Observer,
) -> DisplayImage {
    composite_over(frame, background, &format.view);
    let mut tile = format.to_display(frame, observer);
    label::draw_number(&mut tile, frame.header.number);
    tile
}

/// The sheet of all `tiles`.
///
/// # Errors
/// The tiles differ in size or format.
pub fn compose_contact_sheet(tiles: &[DisplayImage], sheet: &SheetLayout) -> Result<DisplayImage, SheetError> {
    tile_display(tiles, sheet.columns, sheet.gutter, FILL)
}

/// Composites a frame over the background in linear light: its premultiplied light is added to the light that is transmitted. A frame with a
/// plate is unchanged.
fn composite_over(frame: &mut Frame, background: ContactBackground, view: &View) {
    if background == ContactBackground::Checkerboard && !frame.opaque {
        let view = view.with_white_balance(frame.header.white_balance_k.map(f64::from));
        let squares = SQUARES.map(|light| view.to_scene([light; 3]));
        let width = frame.beauty.width();
        for (index, pixel) in frame.beauty.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (index % width, index / width);
            let transmittance = 1.0 - pixel[3].clamp(0.0, 1.0);
            let square = squares[(x / SQUARE + y / SQUARE) % 2];
            (0..3).for_each(|channel| pixel[channel] += transmittance * square[channel]);
            pixel[3] = 1.0;
        }
    }
    frame.opaque = true;
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
        // No content, as in an empty frame.
        frame.content = Rect::from_size(0, 0);
        frame.opaque = opaque;
        composite_over(&mut frame, background, view);
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
    fn over_black_the_light_is_unchanged_whatever_the_alpha() {
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
    fn over_a_checkerboard_light_is_added_to_the_transmitted_light() {
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
            let over = |transmittance: f32| [0, 1, 2].map(|c| [0.3, 0.2, 0.1][c] + transmittance * board[c]);
            is_near(codes[1], view.to_display(over(0.75)));
            is_near(codes[2], view.to_display(over(0.0)));
            is_near(codes[3], view.to_display(over(1.0)));
        }
        assert_eq!([SQUARES[0], SQUARES[1]].map(code), [64 * 257, 96 * 257]);
    }

    #[test]
    fn a_frame_with_a_plate_has_no_other_background() {
        let plate = [[0.3, 0.2, 0.1, 1.0]];
        let [black, board] = [ContactBackground::Black, ContactBackground::Checkerboard]
            .map(|background| shown(&plate, true, background, &View::DISPLAY, None));
        assert_eq!(black, board);
    }
}
