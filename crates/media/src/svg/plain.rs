//! The drawing as `usvg` is given it: only what says where strokes are and whether they are seen. Paint, text, pictures and style sheets are left out, so that
//! nothing is dropped because it is not painted, and none of them costs time.

use std::collections::HashMap;

use bansho_base::host::assets::AssetProblem;
use roxmltree::{Document, Node, NodeId};
use svgtypes::IRI;

use super::style::{self, PROPERTIES, Properties, StyleRules};

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";

/// Attributes of geometry and of what is shown; for `use`, its target.
const ATTRIBUTES: [&str; 16] = [
    "id",
    "d",
    "points",
    "x",
    "y",
    "x1",
    "y1",
    "x2",
    "y2",
    "width",
    "height",
    "viewBox",
    "preserveAspectRatio",
    "systemLanguage",
    "requiredExtensions",
    "requiredFeatures",
];

/// Elements that are drawn and are no strokes. They are kept, since a `switch` may choose them.
const NO_STROKES: [&str; 6] = ["rect", "circle", "ellipse", "text", "image", "foreignObject"];

/// Replaced values of attributes; `None` removes one.
pub(super) type Replacements = HashMap<(NodeId, &'static str), Option<String>>;

/// Whether an element is of SVG; others are not drawn.
fn is_svg(node: Node) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

/// The id of what a `use` shows. An `href` without a prefix comes before `xlink:href`.
pub(super) fn target<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    if node.tag_name().name() != "use" {
        return None;
    }
    let mut hrefs = [None, Some(XLINK)].into_iter().filter_map(|namespace| {
        node.attributes().find(|attribute| attribute.name() == "href" && attribute.namespace() == namespace)
    });
    Some(IRI::from_str(hrefs.next()?.value()).ok()?.0)
}

/// Writes a document that is at most `document::MAX_DEPTH` deep.
pub(super) fn written(document: &Document, replacements: &Replacements) -> Result<String, AssetProblem> {
    let sheets = style::sheets(document);
    let styles = StyleRules::parse(&sheets)?.matches(document)?;
    let mut writer = SvgWriter { text: String::new(), replacements, styles };
    writer.element(document.root_element());
    Ok(writer.text)
}

/// Writes what is left of a document.
struct SvgWriter<'a, 's> {
    text: String,
    replacements: &'a Replacements,
    styles: HashMap<NodeId, Properties<'s>>,
}

impl SvgWriter<'_, '_> {
    fn element(&mut self, node: Node) {
        let name = node.tag_name().name();
        if name == "style" {
            return;
        }
        self.text.push('<');
        self.text.push_str(name);
        self.attributes(node);
        self.text.push('>');
        // What is in a text or a foreign object is not drawn.
        if !NO_STROKES.contains(&name) {
            node.children().filter(|child| is_svg(*child)).for_each(|child| self.element(child));
        }
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push('>');
    }

    fn attributes(&mut self, node: Node) {
        for name in ATTRIBUTES {
            match self.replacements.get(&(node.id(), name)) {
                Some(replaced) => replaced.iter().for_each(|value| self.attribute(name, value)),
                None => node.attribute(name).into_iter().for_each(|value| self.attribute(name, value)),
            }
        }
        if let Some(target) = target(node) {
            self.attribute("href", &format!("#{target}"));
        }
        let mut properties = Properties::of_attributes(|name| node.attribute(name));
        if let Some(style) = self.styles.get(&node.id()) {
            properties.extend(style);
        }
        if let Some(style) = node.attribute("style") {
            properties.extend(&Properties::of_declarations(style));
        }
        let is_stroke = !NO_STROKES.contains(&node.tag_name().name());
        for (property, value) in properties.values().filter(|(property, _)| is_stroke || *property != PROPERTIES[0]) {
            self.attribute(property, value);
        }
        if !is_stroke {
            self.attribute(PROPERTIES[0], "none");
        }
        match node.tag_name().name() {
            // Lines, and nothing else, are drawn of every path.
            _ if node == node.document().root_element() => self.text.push_str(" fill=\"none\" stroke=\"black\""),
            // Otherwise each gets a path that clips it, and all those are compared with one another.
            "svg" => self.text.push_str(" overflow=\"visible\""),
            _ => {}
        }
    }

    fn attribute(&mut self, name: &str, value: &str) {
        self.text.push(' ');
        self.text.push_str(name);
        self.text.push_str("=\"");
        for letter in value.chars() {
            match letter {
                '&' => self.text.push_str("&amp;"),
                '<' => self.text.push_str("&lt;"),
                '"' => self.text.push_str("&quot;"),
                // What a parser of XML makes of them in a value.
                '\n' | '\r' | '\t' => self.text.push(' '),
                letter => self.text.push(letter),
            }
        }
        self.text.push('"');
    }
}
