//! Which layers of an EXR are its colors and its depth, by the names that renderers give them.
//!
//! Channels are `layer.component`; in a file of several parts the name of the part comes before. Blender writes `ViewLayer.Combined.R` and
//! `ViewLayer.Depth.Z`, V-Ray `R` and `ZDepth`, Redshift `R` and `Z.Z`, Arnold and Karma `C.r` or `R` and `Z` or `depth`, Unreal
//! `FinalImage_WorldDepth.R`, Nuke `R` and `depth.Z`.

use bansho_base::host::assets::{AssetProblem, PictureLayers};

use crate::exr::header::FileHeader;

/// What the values of three components are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorModel {
    Rgb,
    /// Y, RY and BY.
    LuminanceChroma,
}

/// The channels of a color, indices in the channel list of their part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ColorChannels {
    pub(super) model: ColorModel,
    color: [usize; 3],
    pub(super) alpha: Option<usize>,
}

impl ColorChannels {
    /// The color of a layer: red, green and blue, else luminance and chroma, else gray; `None` if it has none of them.
    fn of_layer(channels: &[NamedChannel], layer: &str) -> Option<Self> {
        let [r, g, b] =
            [["r", "red"], ["g", "green"], ["b", "blue"]].map(|names| find_component(channels, layer, &names));
        let [y, ry, by] = ["y", "ry", "by"].map(|name| find_component(channels, layer, &[name]));
        let (model, color) = match (r, g, b, y, ry, by) {
            (Some(r), Some(g), Some(b), ..) => (ColorModel::Rgb, [r, g, b]),
            (.., Some(y), Some(ry), Some(by)) => (ColorModel::LuminanceChroma, [y, ry, by]),
            (.., Some(y), _, _) => (ColorModel::Rgb, [y; 3]),
            _ => return None,
        };
        Some(Self { model, color, alpha: find_component(channels, layer, &["a", "alpha"]) })
    }

    /// The three components and alpha.
    pub(super) fn components(&self) -> [Option<usize>; 4] {
        let [a, b, c] = self.color.map(Some);
        [a, b, c, self.alpha]
    }
}

/// The channel of the depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DepthChannel {
    pub(super) part: usize,
    pub(super) channel: usize,
}

/// The selected channels of color and depth.
#[derive(Debug, PartialEq)]
pub(super) struct ChannelSelection {
    /// The part of the colors; without colors, of the depth.
    pub(super) part: usize,
    pub(super) color: Option<ColorChannels>,
    pub(super) depth: Option<DepthChannel>,
}

/// A channel: the name of its layer, and its component.
struct NamedChannel<'a> {
    layer: String,
    component: &'a str,
    channel: usize,
}

/// A layer that has a color.
struct ColorLayer {
    part: usize,
    name: String,
    channels: ColorChannels,
}

/// A channel that may be a depth.
struct DepthCandidate {
    /// Its layer, and its whole name.
    layer: String,
    name: String,
    channel: DepthChannel,
    /// Whether it is called as renderers call depth.
    is_named_depth: bool,
}

/// Last words of the names of layers that are the finished colors, in lower case.
const COLOR_NAMES: [&str; 11] =
    ["", "combined", "rgba", "rgb", "beauty", "c", "ci", "color", "finalimage", "primary", "main"];
/// Last words of the names of layers or channels that are depth along the axis or distance, in lower case.
const DEPTH_NAMES: [&str; 6] = ["depth", "z", "zdepth", "worlddepth", "scenedepthworldunits", "pz"];
/// Last words of the names of layers that are normals, in lower case.
const NORMAL_NAMES: [&str; 3] = ["normal", "normals", "n"];
/// Components that a layer of depth has.
const DEPTH_COMPONENTS: [&str; 6] = ["z", "v", "r", "y", "depth", "x"];

/// The last word of a name of a layer: after the last period, and after the last underscore, before which Unreal puts the picture's name.
fn last_word(layer: &str) -> String {
    let last = layer.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    last.rsplit('_').next().unwrap_or_default().to_owned()
}

fn part_name(header: &FileHeader, part: usize) -> &str {
    if header.parts.len() > 1 { header.parts[part].name.as_deref().unwrap_or_default() } else { "" }
}

/// The channels of a part, with the part's name before theirs unless they have it.
fn channels<'a>(header: &'a FileHeader, part: usize) -> impl Iterator<Item = NamedChannel<'a>> {
    let prefix = part_name(header, part);
    let entries = &header.parts[part].channels;
    entries.iter().enumerate().map(move |(channel, entry)| {
        let (layer, component) = entry.name.rsplit_once('.').unwrap_or(("", &entry.name));
        let layer = match (prefix, layer) {
            ("", layer) => layer.to_owned(),
            (prefix, "") => prefix.to_owned(),
            (prefix, layer) if layer.starts_with(prefix) => layer.to_owned(),
            (prefix, layer) => format!("{prefix}.{layer}"),
        };
        NamedChannel { layer, component, channel }
    })
}

/// The layers of a part that have a color, in the order of their channels.
fn color_layers(header: &FileHeader, part: usize) -> Vec<ColorLayer> {
    let all: Vec<NamedChannel> = channels(header, part).collect();
    let mut names: Vec<&str> = Vec::new();
    for channel in &all {
        if !names.contains(&channel.layer.as_str()) {
            names.push(&channel.layer);
        }
    }
    let mut layers = Vec::new();
    for name in names {
        if let Some(channels) = ColorChannels::of_layer(&all, name) {
            layers.push(ColorLayer { part, name: name.to_owned(), channels });
        }
    }
    layers
}

/// The channel of a layer whose component has one of these names, in any case.
fn find_component(channels: &[NamedChannel], layer: &str, components: &[&str]) -> Option<usize> {
    let mut of_layer = channels.iter().filter(|channel| channel.layer == layer);
    let found = of_layer.find(|channel| components.iter().any(|name| channel.component.eq_ignore_ascii_case(name)));
    found.map(|channel| channel.channel)
}

/// The channels of a layer with these components; `None` if one is missing.
fn components_of_layer(channels: &[NamedChannel], layer: &str, [a, b, c]: [&str; 3]) -> Option<[usize; 3]> {
    let find = |component| find_component(channels, layer, &[component]);
    Some([find(a)?, find(b)?, find(c)?])
}

/// The channels that may be depth: all of them, since a scene may choose any.
fn depth_layers(header: &FileHeader) -> Vec<DepthCandidate> {
    let mut candidates = Vec::new();
    for part in 0..header.parts.len() {
        for NamedChannel { layer, component, channel } in channels(header, part) {
            let name = if layer.is_empty() { component.to_owned() } else { format!("{layer}.{component}") };
            let component = component.to_ascii_lowercase();
            let is_named_depth = if layer.is_empty() {
                DEPTH_NAMES.contains(&component.as_str())
            } else {
                DEPTH_NAMES.contains(&last_word(&layer).as_str()) && DEPTH_COMPONENTS.contains(&component.as_str())
            };
            candidates.push(DepthCandidate { layer, name, channel: DepthChannel { part, channel }, is_named_depth });
        }
    }
    candidates
}

/// Names of layers and of channels without a layer, each once.
fn layer_names(header: &FileHeader) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for part in 0..header.parts.len() {
        for NamedChannel { layer, component, .. } in channels(header, part) {
            let name = if layer.is_empty() { component.to_owned() } else { layer };
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}

impl ChannelSelection {
    /// The colors of a picture, and its depth if it has one.
    pub(super) fn of_picture(header: &FileHeader, layers: &PictureLayers) -> Result<Self, AssetProblem> {
        let color = choose_color(header, layers.image.as_deref())?;
        let prefix = color.as_ref().map(|color| parent(&color.name).to_owned());
        let depth = match (choose_depth(header, layers.depth.as_deref(), prefix.as_deref()), &layers.depth) {
            // Which of several is the picture's own is not known; it is not needed either.
            (Err(AssetProblem::NoKnownLayer { .. }), None) if color.is_some() => None,
            (depth, _) => depth?,
        };
        match (color, depth) {
            (Some(color), depth) => Ok(Self { part: color.part, color: Some(color.channels), depth }),
            (None, Some(depth)) => Ok(Self { part: depth.part, color: None, depth: Some(depth) }),
            (None, None) => Err(AssetProblem::NoKnownLayer {
                use_of_layer: "its colors",
                key: "image_layer",
                layers: layer_names(header),
            }),
        }
    }

    /// The depth alone.
    pub(super) fn of_depth(header: &FileHeader, layer: Option<&str>) -> Result<Self, AssetProblem> {
        let depth = choose_depth(header, layer, None)?.ok_or_else(|| AssetProblem::NoKnownLayer {
            use_of_layer: "depth",
            key: "depth_layer",
            layers: layer_names(header),
        })?;
        Ok(Self { part: depth.part, color: None, depth: Some(depth) })
    }

    /// Normals: the channels X, Y and Z, else those of a layer that is called as renderers call normals, else R, G and B.
    pub(super) fn of_normals(header: &FileHeader) -> Result<Self, AssetProblem> {
        let mut candidates = Vec::new();
        for part in 0..header.parts.len() {
            let all: Vec<NamedChannel> = channels(header, part).collect();
            for layer in all.iter().map(|channel| channel.layer.as_str()) {
                let is_named = NORMAL_NAMES.contains(&last_word(layer).as_str());
                let vector = components_of_layer(&all, layer, ["x", "y", "z"]);
                let color = components_of_layer(&all, layer, ["r", "g", "b"]);
                let rank = match (layer, is_named, vector, color) {
                    ("", _, Some(_), _) => 0,
                    (_, true, ..) => 1,
                    ("", _, None, Some(_)) => 2,
                    _ => continue,
                };
                candidates.extend(vector.or(color).map(|channels| (rank, part, channels)));
            }
        }
        let best = candidates.into_iter().min_by_key(|(rank, ..)| *rank);
        let (_, part, color) = best.ok_or_else(|| AssetProblem::NoChannel("X".to_owned()))?;
        let channels = ColorChannels { model: ColorModel::Rgb, color, alpha: None };
        Ok(Self { part, color: Some(channels), depth: None })
    }

    /// Whether any of its channels is in this part.
    pub(super) fn contains_part(&self, part: usize) -> bool {
        (self.color.is_some() && part == self.part) || self.depth.is_some_and(|depth| depth.part == part)
    }
}

/// The name before the last period.
fn parent(layer: &str) -> &str {
    layer.rsplit_once('.').map_or("", |(parent, _)| parent)
}

/// The layer of the colors; `None` if the file has no colors at all.
fn choose_color(header: &FileHeader, wanted: Option<&str>) -> Result<Option<ColorLayer>, AssetProblem> {
    let mut all: Vec<ColorLayer> = (0..header.parts.len()).flat_map(|part| color_layers(header, part)).collect();
    if let Some(wanted) = wanted {
        let Some(layer) = all.into_iter().find(|layer| layer.name == wanted) else {
            let (layer, layers) = (wanted.to_owned(), layer_names(header));
            return Err(AssetProblem::NoLayer { layer, use_of_layer: "colors", layers });
        };
        return Ok(Some(layer));
    }
    if all.len() < 2 {
        // A file of depth alone is one of gray only where the channel is called so.
        return Ok(all.pop());
    }
    // The names in the order of their certainty: of a file with `beauty` and `color`, the first. Where two layers have one, neither is chosen.
    for color_name in COLOR_NAMES {
        let mut fitting = (0..all.len()).filter(|&index| last_word(&all[index].name) == color_name);
        match (fitting.next(), fitting.next()) {
            (Some(index), None) => return Ok(Some(all.swap_remove(index))),
            (Some(_), Some(_)) => break,
            (None, _) => {}
        }
    }
    Err(AssetProblem::NoKnownLayer { use_of_layer: "its colors", key: "image_layer", layers: layer_names(header) })
}

/// The channel of the depth; `None` if no channel is known to be one. `prefix` is the name before that of the picture's colors.
fn choose_depth(
    header: &FileHeader,
    wanted: Option<&str>,
    prefix: Option<&str>,
) -> Result<Option<DepthChannel>, AssetProblem> {
    let all = depth_layers(header);
    if let Some(wanted) = wanted {
        let Some(chosen) = all.iter().find(|candidate| candidate.name == wanted || candidate.layer == wanted) else {
            let (layer, layers) = (wanted.to_owned(), layer_names(header));
            return Err(AssetProblem::NoLayer { layer, use_of_layer: "depth", layers });
        };
        return Ok(Some(chosen.channel));
    }
    if let [only] = &all[..] {
        return Ok(Some(only.channel));
    }
    // A layer of several components, such as a depth in R, G and B, counts once.
    let mut depths: Vec<&DepthCandidate> = all.iter().filter(|candidate| candidate.is_named_depth).collect();
    depths.dedup_by(|a, b| !a.layer.is_empty() && a.layer == b.layer && a.channel.part == b.channel.part);
    // Of several, the `Z` of the whole file, else the only one of the layers among which the colors are.
    let plain = depths.iter().find(|depth| depth.layer.is_empty() && depth.name.eq_ignore_ascii_case("z"));
    let mut siblings = depths.iter().filter(|depth| prefix.is_some_and(|prefix| parent(&depth.layer) == prefix));
    match (&depths[..], plain, siblings.next(), siblings.next()) {
        ([], ..) => Ok(None),
        ([only], ..) => Ok(Some(only.channel)),
        (_, Some(plain), ..) => Ok(Some(plain.channel)),
        (_, None, Some(sibling), None) => Ok(Some(sibling.channel)),
        _ => Err(AssetProblem::NoKnownLayer { use_of_layer: "depth", key: "depth_layer", layers: layer_names(header) }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr::header::{ChannelEntry, PartHeader};

    fn part(name: Option<&str>, channels: &[&str]) -> PartHeader {
        let mut channels: Vec<ChannelEntry> = channels
            .iter()
            .map(|name| ChannelEntry { name: (*name).to_owned(), bytes_per_sample: 2, sampling: [1, 1] })
            .collect();
        channels.sort_by(|a, b| a.name.cmp(&b.name));
        PartHeader { name: name.map(str::to_owned), channels, ..PartHeader::default() }
    }

    fn file(parts: Vec<PartHeader>) -> FileHeader {
        FileHeader { parts, deep: false }
    }

    /// The names of the first color channel, of alpha and of depth.
    fn chosen(header: &FileHeader, layers: &PictureLayers) -> Result<[Option<String>; 3], AssetProblem> {
        let selection = ChannelSelection::of_picture(header, layers)?;
        let name = |part: usize, channel: usize| header.parts[part].channels[channel].name.clone();
        let [red, _, _, alpha] = selection.color.map_or([None; 4], |color| color.components());
        let own = |channel: Option<usize>| channel.map(|channel| name(selection.part, channel));
        Ok([own(red), own(alpha), selection.depth.map(|depth| name(depth.part, depth.channel))])
    }

    fn names(parts: Vec<PartHeader>) -> [Option<String>; 3] {
        chosen(&file(parts), &PictureLayers::default()).unwrap()
    }

    fn expected(names: [&str; 3]) -> [Option<String>; 3] {
        names.map(|name| (!name.is_empty()).then(|| name.to_owned()))
    }

    fn rgb(layer: &str) -> [String; 3] {
        ["R", "G", "B"].map(|component| format!("{layer}.{component}"))
    }

    #[test]
    fn beauty_and_depth_are_found_by_the_conventions_of_renderers() {
        let one = |channels: &[&str]| names(vec![part(None, channels)]);
        let blender = [
            "ViewLayer.AO.R",
            "ViewLayer.AO.G",
            "ViewLayer.AO.B",
            "ViewLayer.Combined.R",
            "ViewLayer.Combined.G",
            "ViewLayer.Combined.B",
            "ViewLayer.Combined.A",
            "ViewLayer.Depth.Z",
            "ViewLayer.Normal.X",
            "ViewLayer.Normal.Y",
            "ViewLayer.Normal.Z",
        ];
        assert_eq!(one(&blender), expected(["ViewLayer.Combined.R", "ViewLayer.Combined.A", "ViewLayer.Depth.Z"]));
        assert_eq!(one(&["R", "G", "B", "A", "ZDepth", "N.Z"]), expected(["R", "A", "ZDepth"]));
        assert_eq!(one(&["R", "G", "B", "Z.Z", "diffuse.R", "diffuse.G", "diffuse.B"]), expected(["R", "", "Z.Z"]));
        assert_eq!(one(&["C.r", "C.g", "C.b", "C.a", "depth", "P.z"]), expected(["C.r", "C.a", "depth"]));
        let unreal = [
            "R",
            "G",
            "B",
            "A",
            "FinalImageMovieRenderQueue_WorldDepth.R",
            "FinalImageMovieRenderQueue_WorldDepth.G",
            "FinalImageMovieRenderQueue_WorldDepth.B",
        ];
        assert_eq!(
            one(&unreal),
            expected(["R", "A", "FinalImageMovieRenderQueue_WorldDepth.B"])
                .map(|name| name.map(|name| name.replace("Depth.B", "Depth.R")))
        );
        assert_eq!(one(&["R", "G", "B", "depth.Z", "P.Z"]), expected(["R", "", "depth.Z"]));
        assert_eq!(one(&["distance"]), expected(["", "", "distance"]));
        assert_eq!(one(&["plate.R", "plate.G", "plate.B"]), expected(["plate.R", "", ""]));
        // Blender 5 writes a part for each pass.
        let parts = [
            ("ViewLayer.AO", vec!["R", "G", "B"]),
            ("ViewLayer.Combined", vec!["R", "G", "B", "A"]),
            ("ViewLayer.Depth", vec!["Z"]),
        ];
        let selection = ChannelSelection::of_picture(
            &file(parts.iter().map(|(name, channels)| part(Some(name), channels)).collect()),
            &PictureLayers::default(),
        )
        .unwrap();
        assert_eq!((selection.part, selection.depth.map(|depth| depth.part)), (1, Some(2)));
    }

    #[test]
    fn a_pass_of_another_meaning_is_never_taken_and_the_error_lists_what_is_there() {
        let passes: Vec<String> = ["AO", "Emit"].into_iter().flat_map(rgb).collect();
        let header = file(vec![part(None, &passes.iter().map(String::as_str).collect::<Vec<_>>())]);
        let error = chosen(&header, &PictureLayers::default()).unwrap_err().to_string();
        assert!(error.contains("it has AO, Emit; select one with `image_layer` in [plate]"), "{error}");
        let layers = PictureLayers { image: Some("Emit".to_owned()), depth: None };
        assert_eq!(chosen(&header, &layers).unwrap(), expected(["Emit.R", "", ""]));
        let layers = PictureLayers { image: Some("Diffuse".to_owned()), depth: None };
        assert!(
            chosen(&header, &layers)
                .unwrap_err()
                .to_string()
                .contains("has no layer `Diffuse` of colors; it has AO, Emit")
        );
        let layers = PictureLayers { image: Some("AO".to_owned()), depth: Some("Emit.G".to_owned()) };
        assert_eq!(chosen(&header, &layers).unwrap(), expected(["AO.R", "", "Emit.G"]));
        let none = ChannelSelection::of_depth(&header, None).unwrap_err().to_string();
        assert!(none.contains("select one with `depth_layer` in [plate]"), "{none}");
    }

    #[test]
    fn normals_are_plain_vectors_or_a_layer_of_that_name() {
        let components = |parts: Vec<PartHeader>| {
            let header = file(parts);
            let selection = ChannelSelection::of_normals(&header).ok()?;
            let color = selection.color?.components();
            Some(
                color.map(|channel| channel.map(|channel| header.parts[selection.part].channels[channel].name.clone())),
            )
        };
        let one = |channels: &[&str]| components(vec![part(None, channels)]);
        let expected = |names: [&str; 3]| {
            let [x, y, z] = names.map(|name| Some(name.to_owned()));
            Some([x, y, z, None])
        };
        assert_eq!(one(&["X", "Y", "Z"]), expected(["X", "Y", "Z"]));
        assert_eq!(one(&["R", "G", "B", "A", "N.X", "N.Y", "N.Z"]), expected(["N.X", "N.Y", "N.Z"]));
        assert_eq!(one(&["R", "G", "B", "Z"]), expected(["R", "G", "B"]));
        assert_eq!(
            components(vec![part(Some("Z"), &["Z"]), part(Some("Normal"), &["x", "y", "z"])]),
            expected(["x", "y", "z"])
        );
        assert_eq!(one(&["Y", "Z"]), None);
    }

    #[test]
    fn the_depth_is_that_of_the_view_layer_of_the_colors() {
        let mut channels: Vec<String> = ["near.Combined", "far.AO"].into_iter().flat_map(rgb).collect();
        channels.extend(["near.Depth.Z", "far.Depth.Z"].map(str::to_owned));
        let found = names(vec![part(None, &channels.iter().map(String::as_str).collect::<Vec<_>>())]);
        assert_eq!(found, expected(["near.Combined.R", "", "near.Depth.Z"]));
    }
}
