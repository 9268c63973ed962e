//! Command line of `ffmpeg`.

use std::{ffi::OsString, path::Path};

use super::{VideoContainer, VideoFormat, WebmCodec};
use crate::{files::provenance, png::KEY_ALPHA};

/// All arguments for a film at `output`, which exists and is empty.
pub(super) fn arguments(format: &VideoFormat, output: &Path) -> Vec<OsString> {
    let [width, height] = format.encoded_size();
    let [frames, seconds] = format.fps;
    let (size, rate) = (format!("{width}x{height}"), format!("{frames}/{seconds}"));
    let input = if format.sixteen_bits { "rgba64le" } else { "rgba" };
    let pixels = pixel_format(format);
    // The scaler needs the matrix, which it otherwise guesses. The frames need the tags (`setparams`), because ProRes takes them from
    // there. The
    // options in `tags` are for the container.
    let filter = format!(
        "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp+bitexact,\
         format={pixels},setparams=range=tv:color_primaries=bt709:color_trc=iec61966-2-1:colorspace=bt709"
    );
    let input = ["-f", "rawvideo", "-pixel_format", input, "-video_size", &size, "-framerate", &rate, "-i", "pipe:0"];
    let tags = [
        ["-color_primaries", "bt709"],
        ["-color_trc", "iec61966-2-1"],
        ["-colorspace", "bt709"],
        ["-color_range", "tv"],
        ["-fflags", "+bitexact"],
        ["-flags:v", "+bitexact"],
        ["-map_metadata", "-1"],
    ];
    let (convention, tag) = (format!("{KEY_ALPHA}={}", format.alpha.name()), provenance_tag(format.container));
    let alpha = ["-metadata", &convention].into_iter().filter(|_| !format.is_opaque());
    let start = ["-y", "-nostdin", "-hide_banner", "-nostats", "-loglevel", "error", "-xerror"];
    let words = start.into_iter().chain(input).chain(["-an", "-vf", &filter]).chain(codec(format).iter().copied());
    let words = words.chain(tags.into_iter().flatten()).chain(alpha).chain(["-metadata", &tag]);
    let words = words.chain(["-f", muxer(format.container)]);
    words.map(OsString::from).chain([output.as_os_str().to_owned()]).collect()
}

/// The provenance tag. MP4 has no custom tags, so it is the comment there.
fn provenance_tag(container: VideoContainer) -> String {
    match container {
        VideoContainer::Mp4 => format!("comment={}", provenance::COMMENT_TAG),
        VideoContainer::Mov | VideoContainer::Webm => provenance::COMMENT_TAG.to_owned(),
    }
}

fn pixel_format(format: &VideoFormat) -> &'static str {
    match (format.container, format.options.webm, format.is_opaque()) {
        (VideoContainer::Mov, _, false) => "yuva444p10le",
        (VideoContainer::Mov, _, true) => "yuv444p10le",
        (VideoContainer::Webm, WebmCodec::Av1, _) => "yuv420p10le",
        (VideoContainer::Webm, WebmCodec::Vp9, false) => "yuva420p",
        (VideoContainer::Webm, WebmCodec::Vp9, true) | (VideoContainer::Mp4, ..) => "yuv420p",
    }
}

fn codec(format: &VideoFormat) -> &'static [&'static str] {
    match (format.container, format.options.webm) {
        // 16 bits of straight alpha, and the vendor code that other programs expect.
        (VideoContainer::Mov, _) => &[
            "-c:v",
            "prores_ks",
            "-profile:v",
            "4444",
            "-alpha_bits",
            "16",
            "-vendor",
            "apl0",
            "-movflags",
            "+write_colr+use_metadata_tags",
        ],
        (VideoContainer::Webm, WebmCodec::Av1) => &["-c:v", "libsvtav1", "-preset", "8", "-crf", "24", "-g", "120"],
        // Alternate reference frames do not work with alpha.
        (VideoContainer::Webm, WebmCodec::Vp9) => {
            &["-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0", "-row-mt", "1", "-cpu-used", "4", "-auto-alt-ref", "0"]
        }
        // Dark gradients of fire and night need a higher quality than the default. The index goes to the front, for
        // streaming.
        (VideoContainer::Mp4, _) => {
            &["-c:v", "libx264", "-preset", "medium", "-crf", "16", "-movflags", "+faststart+write_colr"]
        }
    }
}

/// The name of `ffmpeg`'s muxer for a container.
fn muxer(container: VideoContainer) -> &'static str {
    match container {
        VideoContainer::Mp4 => "mp4",
        VideoContainer::Mov => "mov",
        VideoContainer::Webm => "webm",
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::color::AlphaConvention;

    use super::{super::VideoOptions, *};

    fn words(container: VideoContainer, opaque: bool, webm: WebmCodec) -> String {
        let options = VideoOptions { webm, ..VideoOptions::default() };
        let (size, fps, alpha) = ([65, 48], [24000, 1001], AlphaConvention::Encoded);
        let format = VideoFormat { container, size, fps, opaque, alpha, sixteen_bits: false, options };
        let words: Vec<_> =
            arguments(&format, Path::new("t.part")).into_iter().map(|word| word.into_string().unwrap()).collect();
        words.join(" ")
    }

    #[test]
    fn every_film_names_its_matrix_transfer_and_rate() {
        for container in [VideoContainer::Mp4, VideoContainer::Mov, VideoContainer::Webm] {
            let words = words(container, false, WebmCodec::Vp9);
            for part in
                ["out_color_matrix=bt709", "-colorspace bt709", "-color_trc iec61966-2-1", "-framerate 24000/1001"]
            {
                assert!(words.contains(part), "{words}");
            }
            assert!(words.ends_with(&format!("-f {} t.part", muxer(container))), "{words}");
        }
    }

    #[test]
    fn alpha_is_kept_where_the_codec_has_it() {
        assert!(words(VideoContainer::Mov, false, WebmCodec::Vp9).contains("format=yuva444p10le"));
        assert!(words(VideoContainer::Mov, true, WebmCodec::Vp9).contains("format=yuv444p10le"));
        assert!(words(VideoContainer::Webm, false, WebmCodec::Vp9).contains("format=yuva420p,"));
        assert!(words(VideoContainer::Webm, false, WebmCodec::Av1).contains("format=yuv420p10le"));
        assert!(words(VideoContainer::Mp4, false, WebmCodec::Vp9).contains("format=yuv420p,"));
        let names_its_alpha =
            |container, opaque, webm| words(container, opaque, webm).contains("-metadata bansho:alpha=encoded");
        for container in [VideoContainer::Mov, VideoContainer::Webm] {
            assert!(
                names_its_alpha(container, false, WebmCodec::Vp9) && !names_its_alpha(container, true, WebmCodec::Vp9)
            );
        }
        assert!(!names_its_alpha(VideoContainer::Webm, false, WebmCodec::Av1));
        assert!(!names_its_alpha(VideoContainer::Mp4, false, WebmCodec::Vp9));
    }

    #[test]
    fn odd_sides_are_padded_but_for_prores() {
        assert!(words(VideoContainer::Mp4, true, WebmCodec::Vp9).contains("66x48"));
        assert!(words(VideoContainer::Mov, true, WebmCodec::Vp9).contains("65x48"));
    }
}
