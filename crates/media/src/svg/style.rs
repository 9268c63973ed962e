//! What style sheets say about where strokes are and whether they are seen. Their selectors are matched here, in time that is linear in the drawing
//! and in the sheets, since the matching of `usvg` tries every rule on every element, and for `a b c` every chain of ancestors.
//!
//! A selector is a chain of compound selectors, here called parts. An element satisfies a part if it has the part's name, classes and attributes, and
//! the part before it is satisfied by an ancestor, the parent or the element before, as the combinator says. Elements are visited in document
//! order, so that what those satisfy is known, and each element is compared only with parts that name its id, one of its classes or its tag.

use std::{borrow::Cow, collections::HashMap};

use bansho_base::host::assets::AssetProblem;
use roxmltree::{Document, Node, NodeId};
use simplecss::{AttributeOperator, DeclarationTokenizer, SelectorToken, SelectorTokenizer};
use svgtypes::FontShorthand;

use super::damaged;

/// Most parts and conditions of all selectors.
const MAX_PARTS: usize = 1_000_000;
/// Most comparisons of elements with parts, in multiples of 64 letters.
const MAX_COMPARISONS: u64 = 5_000_000;

/// Properties that say where strokes are and whether they are seen; all others are about paint.
pub(super) const PROPERTIES: [&str; 5] = ["display", "visibility", "transform", "transform-origin", "font-size"];

/// A value, and whether it is `!important`.
type Value<'a> = (&'a str, bool);

/// Values of [`PROPERTIES`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Properties<'a>([Option<Value<'a>>; PROPERTIES.len()]);

impl<'a> Properties<'a> {
    /// The properties and values that are set.
    pub(super) fn values(&self) -> impl Iterator<Item = (&'static str, &'a str)> {
        PROPERTIES.into_iter().zip(self.0).filter_map(|(name, value)| Some((name, value?.0)))
    }

    /// The values of attributes.
    pub(super) fn of_attributes(attribute: impl Fn(&'static str) -> Option<&'a str>) -> Self {
        Self(PROPERTIES.map(|name| Some((attribute(name)?, false))))
    }

    /// The values of declarations in their order.
    pub(super) fn of_declarations(text: &'a str) -> Self {
        let mut properties = Self::default();
        for declaration in DeclarationTokenizer::from(text) {
            properties.set(declaration.name, (declaration.value, declaration.important));
        }
        properties
    }

    /// Sets what is set in `later`.
    pub(super) fn extend(&mut self, later: &Self) {
        for (value, later) in self.0.iter_mut().zip(later.0) {
            if !matches!(value, Some((_, true))) {
                *value = later.or(*value);
            }
        }
    }

    fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// Sets a property, unless what it is set to is important.
    fn set(&mut self, name: &str, (value, important): Value<'a>) {
        let (name, value) = match name {
            "font" => match FontShorthand::from_str(value) {
                Ok(font) => ("font-size", font.font_size),
                Err(_) => return,
            },
            name => (name, value),
        };
        if let Some(index) = PROPERTIES.iter().position(|property| *property == name)
            && !matches!(self.0[index], Some((_, true)))
        {
            self.0[index] = Some((value, important));
        }
    }
}

/// The texts of all style sheets, without comments.
pub(super) fn sheets(document: &Document) -> Vec<String> {
    let sheets = document
        .descendants()
        .filter(|node| node.tag_name().name() == "style" && matches!(node.attribute("type"), None | Some("text/css")));
    sheets
        .map(|sheet| {
            let text: String = sheet.children().filter_map(|child| child.text()).collect();
            without_comments(&text).into_owned()
        })
        .collect()
}

fn without_comments(text: &str) -> Cow<'_, str> {
    if !text.contains("/*") {
        return text.into();
    }
    let (mut result, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = rest.find("/*") {
        result.push_str(&rest[..start]);
        rest = rest[start + 2..].split_once("*/").map_or("", |(_, after)| after);
    }
    (result + rest).into()
}

/// A condition of a part on an attribute.
struct Condition<'a> {
    name: &'a str,
    operator: AttributeOperator<'a>,
}

/// How the element that satisfies the part before is related.
#[derive(Clone, Copy, PartialEq)]
enum Combinator {
    First,
    Descendant,
    Child,
    Adjacent,
}

/// A compound selector such as `g.both[id]`. The part before it in a selector is the one before it in the list.
struct Part<'a> {
    combinator: Combinator,
    tag: Option<&'a str>,
    conditions: Vec<Condition<'a>>,
    is_first_child: bool,
    /// It can match nothing: `:hover`.
    is_never: bool,
    /// The rule whose selector ends here.
    rule: Option<usize>,
}

impl Part<'_> {
    fn after(combinator: Combinator) -> Self {
        Self { combinator, tag: None, conditions: Vec::new(), is_first_child: false, is_never: false, rule: None }
    }
}

/// A selector with its declarations.
struct Rule<'a> {
    specificity: [u8; 3],
    properties: Properties<'a>,
}

/// The rules of style sheets, with their parts by what an element must have.
#[derive(Default)]
pub(super) struct StyleRules<'a> {
    rules: Vec<Rule<'a>>,
    parts: Vec<Part<'a>>,
    by_id: HashMap<&'a str, Vec<usize>>,
    by_class: HashMap<&'a str, Vec<usize>>,
    by_tag: HashMap<&'a str, Vec<usize>>,
    of_all: Vec<usize>,
}

impl<'a> StyleRules<'a> {
    /// Reads style sheets. What cannot be read is skipped, as by a browser.
    pub(super) fn parse(sheets: &'a [String]) -> Result<Self, AssetProblem> {
        let mut rules = Self::default();
        for sheet in sheets {
            rules.add_sheet(sheet)?;
        }
        rules.index();
        Ok(rules)
    }

    fn add_sheet(&mut self, mut rest: &'a str) -> Result<(), AssetProblem> {
        let mut conditions = 0;
        while let Some(start) = rest.find(['{', ';']) {
            let head = rest[..start].trim_matches(|letter: char| letter.is_whitespace() || letter == '}');
            let is_at_rule = head.starts_with('@');
            if rest.as_bytes()[start] == b';' {
                // The end of `@import`; within a selector it is part of what cannot be read.
                rest = &rest[start + 1..];
                continue;
            }
            let (block, after) = block(&rest[start + 1..]);
            rest = after;
            if is_at_rule {
                continue;
            }
            let properties = Properties::of_declarations(block);
            if properties.is_empty() {
                continue;
            }
            for selector in selectors(head) {
                if let Some((parts, specificity)) = parse_selector(selector) {
                    conditions += parts.iter().map(|part| 1 + part.conditions.len()).sum::<usize>();
                    self.parts.extend(parts);
                    if let Some(last) = self.parts.last_mut() {
                        last.rule = Some(self.rules.len());
                    }
                    self.rules.push(Rule { specificity, properties });
                }
                if conditions > MAX_PARTS {
                    let reason = format!("its style sheets have more than {MAX_PARTS} parts of selectors");
                    return Err(damaged(reason));
                }
            }
        }
        Ok(())
    }

    /// Lists the parts by what an element must have to satisfy them.
    fn index(&mut self) {
        for (index, part) in self.parts.iter().enumerate().filter(|(_, part)| !part.is_never) {
            let (mut id, mut class) = (None, None);
            for Condition { name, operator } in &part.conditions {
                match (*name, operator) {
                    ("id", AttributeOperator::Matches(value)) => id = id.or(Some(*value)),
                    ("class", AttributeOperator::Contains(value)) => class = class.or(Some(*value)),
                    _ => {}
                }
            }
            // By what is rarest in a drawing: few elements have an id or a class in common, many have a tag.
            let list = if let Some(id) = id {
                self.by_id.entry(id).or_default()
            } else if let Some(class) = class {
                self.by_class.entry(class).or_default()
            } else if let Some(tag) = part.tag {
                self.by_tag.entry(tag).or_default()
            } else {
                &mut self.of_all
            };
            list.push(index);
        }
    }

    /// What the rules set for each element of a document that is at most `document::MAX_DEPTH` deep.
    pub(super) fn matches(&self, document: &Document) -> Result<HashMap<NodeId, Properties<'a>>, AssetProblem> {
        Ok(self.matches_and_comparisons(document)?.0)
    }

    fn matches_and_comparisons(
        &self,
        document: &Document,
    ) -> Result<(HashMap<NodeId, Properties<'a>>, u64), AssetProblem> {
        let mut matching =
            Matching { rules: self, above: vec![0; self.parts.len()], comparisons: 0, properties: HashMap::new() };
        if !self.rules.is_empty() {
            matching.visit(document.root_element(), &[], &[], true)?;
        }
        Ok((matching.properties, matching.comparisons))
    }
}

/// The text up to the brace that closes a block, and what comes after it.
fn block(text: &str) -> (&str, &str) {
    let mut depth = 0;
    for (index, letter) in text.match_indices(['{', '}']) {
        match letter {
            "{" => depth += 1,
            _ if depth > 0 => depth -= 1,
            _ => return (&text[..index], &text[index + 1..]),
        }
    }
    (text, "")
}

/// The selectors of a list, which are separated by commas outside of quotes.
fn selectors(head: &str) -> impl Iterator<Item = &str> {
    let mut quote = None;
    head.split(move |letter| {
        match (quote, letter) {
            (None, '"' | '\'') => quote = Some(letter),
            (Some(open), _) if open == letter => quote = None,
            _ => {}
        }
        letter == ',' && quote.is_none()
    })
    .map(str::trim)
}

/// The parts of a selector, and its specificity; `None` if it cannot be read.
fn parse_selector(text: &str) -> Option<(Vec<Part<'_>>, [u8; 3])> {
    let (mut parts, mut specificity) = (Vec::<Part>::new(), [0_u8; 3]);
    let mut combinator = Some(Combinator::First);
    for token in SelectorTokenizer::from(text) {
        let token = token.ok()?;
        let next = match token {
            SelectorToken::DescendantCombinator => Some(Combinator::Descendant),
            SelectorToken::ChildCombinator => Some(Combinator::Child),
            SelectorToken::AdjacentCombinator => Some(Combinator::Adjacent),
            _ => None,
        };
        if next.is_some() {
            combinator = next;
            continue;
        }
        if let Some(combinator) = combinator.take() {
            parts.push(Part::after(combinator));
        }
        let part = parts.last_mut()?;
        // Which number of the specificity it raises: of ids, of classes and attributes, of tags.
        let kind = match token {
            SelectorToken::TypeSelector(tag) => {
                part.tag = Some(tag);
                2
            }
            SelectorToken::ClassSelector(class) => {
                part.conditions.push(Condition { name: "class", operator: AttributeOperator::Contains(class) });
                1
            }
            SelectorToken::IdSelector(id) => {
                part.conditions.push(Condition { name: "id", operator: AttributeOperator::Matches(id) });
                0
            }
            SelectorToken::AttributeSelector(name, operator) => {
                part.conditions.push(Condition { name, operator });
                if name == "id" { 0 } else { 1 }
            }
            SelectorToken::PseudoClass("first-child") => {
                part.is_first_child = true;
                1
            }
            SelectorToken::PseudoClass("link" | "visited" | "hover" | "active" | "focus")
            | SelectorToken::LangPseudoClass(_) => {
                part.is_never = true;
                1
            }
            SelectorToken::PseudoClass(_) => return None,
            _ => continue,
        };
        specificity[kind] = specificity[kind].saturating_add(1);
    }
    (!parts.is_empty()).then_some((parts, specificity))
}

/// The state of the visit to all elements.
struct Matching<'r, 'a> {
    rules: &'r StyleRules<'a>,
    /// How many of the elements around the current one satisfy each part.
    above: Vec<u16>,
    comparisons: u64,
    properties: HashMap<NodeId, Properties<'a>>,
}

impl Matching<'_, '_> {
    /// Visits an element and all in it. `parent` and `before` are the parts that its parent and the element before it satisfy, ascending. Tells
    /// which ones it satisfies.
    fn visit(
        &mut self,
        element: Node,
        parent: &[usize],
        before: &[usize],
        is_first: bool,
    ) -> Result<Vec<usize>, AssetProblem> {
        let satisfied = self.satisfied(element, parent, before, is_first)?;
        let mut matched: Vec<usize> = satisfied.iter().filter_map(|part| self.rules.parts[*part].rule).collect();
        if !matched.is_empty() {
            // Rules of equal specificity stay in the order of the sheets.
            matched.sort_by_key(|rule| (self.rules.rules[*rule].specificity, *rule));
            let mut properties = Properties::default();
            matched.iter().for_each(|rule| properties.extend(&self.rules.rules[*rule].properties));
            self.properties.insert(element.id(), properties);
        }
        satisfied.iter().for_each(|part| self.above[*part] += 1);
        let (mut previous, mut is_first) = (Vec::new(), true);
        for child in element.children().filter(Node::is_element) {
            previous = self.visit(child, &satisfied, &previous, is_first)?;
            is_first = false;
        }
        satisfied.iter().for_each(|part| self.above[*part] -= 1);
        Ok(satisfied)
    }

    /// The parts that an element satisfies, ascending.
    fn satisfied(
        &mut self,
        element: Node,
        parent: &[usize],
        before: &[usize],
        is_first: bool,
    ) -> Result<Vec<usize>, AssetProblem> {
        let rules = self.rules;
        let mut classes: Vec<&str> = element.attribute("class").unwrap_or_default().split_ascii_whitespace().collect();
        classes.sort_unstable();
        classes.dedup();
        let mut candidates = rules.of_all.clone();
        candidates.extend(rules.by_tag.get(element.tag_name().name()).into_iter().flatten());
        candidates.extend(element.attribute("id").and_then(|id| rules.by_id.get(id)).into_iter().flatten());
        // Counted in between, since an element may have many classes and each many parts.
        for class in &classes {
            candidates.extend(rules.by_class.get(class).into_iter().flatten());
            self.count(candidates.len())?;
        }
        self.count(candidates.len())?;
        candidates.sort_unstable();
        let mut satisfied = Vec::new();
        for index in candidates {
            let part = &rules.parts[index];
            let follows = match part.combinator {
                Combinator::First => true,
                Combinator::Descendant => self.above[index - 1] > 0,
                Combinator::Child => parent.binary_search(&(index - 1)).is_ok(),
                Combinator::Adjacent => before.binary_search(&(index - 1)).is_ok(),
            };
            let is_named = part.tag.is_none_or(|tag| element.tag_name().name() == tag);
            if follows && is_named && (is_first || !part.is_first_child) && self.has(element, &classes, part)? {
                satisfied.push(index);
            }
        }
        Ok(satisfied)
    }

    /// Whether an element has the attributes of a part.
    fn has(&mut self, element: Node, classes: &[&str], part: &Part) -> Result<bool, AssetProblem> {
        for Condition { name, operator } in &part.conditions {
            let holds = match operator {
                AttributeOperator::Contains(class) if *name == "class" => {
                    self.count(1)?;
                    classes.binary_search(class).is_ok()
                }
                operator => {
                    let value = element.attribute(*name);
                    // An attribute is searched among all of the element, and its value is compared letter by letter.
                    self.count(1 + element.attributes().len() / 8 + value.map_or(0, str::len) / 64)?;
                    value.is_some_and(|value| operator.matches(value))
                }
            };
            if !holds {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Counts comparisons, in multiples of about 64 letters.
    fn count(&mut self, comparisons: usize) -> Result<(), AssetProblem> {
        self.comparisons += comparisons as u64;
        if self.comparisons > MAX_COMPARISONS {
            let reason = format!(
                "its style sheets need more than {MAX_COMPARISONS} comparisons with its elements; remove rules that set {}",
                PROPERTIES.join(", ")
            );
            return Err(damaged(reason));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ids of the elements for which `css` sets anything, each with what it sets, and the number of comparisons.
    fn matched(css: &str, body: &str) -> (Vec<String>, u64) {
        let text = format!("<svg>{body}</svg>");
        let document = Document::parse(&text).unwrap();
        let sheets = [without_comments(css).into_owned()];
        let rules = StyleRules::parse(&sheets).unwrap();
        let (found, comparisons) = rules.matches_and_comparisons(&document).unwrap();
        let describe = |node: Node| {
            let values: Vec<String> =
                found.get(&node.id())?.values().map(|(name, value)| format!("{name}={value}")).collect();
            Some(format!("{} {}", node.attribute("id").unwrap_or(node.tag_name().name()), values.join(" ")))
        };
        (document.descendants().filter_map(describe).collect(), comparisons)
    }

    const BODY: &str = "<g id='a' class='x y'><path id='b'/><g id='c' class='y'><path id='d' class='z off' lang='de-AT'/>\
        <path id='e'/></g></g><path id='f' class='y'/>";

    #[test]
    fn selectors_match_as_in_css() {
        for (selector, expected) in [
            ("path", "b d e f"),
            ("*", "svg a b c d e f"),
            (".y", "a c f"),
            ("#d", "d"),
            ("g.y.x", "a"),
            ("g path", "b d e"),
            ("g > path", "b d e"),
            ("g g > path", "d e"),
            (".x > path", "b"),
            ("g g g path", ""),
            ("svg g path", "b d e"),
            ("g + path", "f"),
            ("path + path", "e"),
            ("path:first-child", "b d"),
            ("path:hover", ""),
            ("[class]", "a c d f"),
            ("[class='y']", "c f"),
            ("[class~=off]", "d"),
            ("[lang|=de]", "d"),
            (".z, #f ,b", "d f"),
            ("path::after, #e", "e"),
            ("path:not(.y)", ""),
            ("g/* a comment, { */ .z", "d"),
            ("[id='a,b'], #b", "b"),
        ] {
            let (found, _) = matched(
                &format!("@import 'x'; @media print {{ path {{ display: none }} }} {selector}{{display:none}}"),
                BODY,
            );
            let found: Vec<&str> = found.iter().map(|text| text.split(' ').next().unwrap()).collect();
            assert_eq!(found.join(" "), expected, "{selector}");
        }
    }

    #[test]
    fn the_more_specific_and_the_important_rule_wins() {
        for (css, expected) in [
            ("#d{display:a} .z{display:b} path{display:c}", "display=a"),
            ("path{display:a} path{display:b}", "display=b"),
            ("path{display:a !important} #d{display:b}", "display=a"),
            ("path{display:a; display:b; fill:red}", "display=b"),
            ("path{fill:red} #d{stroke:red}", ""),
            ("path{font:3px serif;transform:rotate(3)}", "transform=rotate(3) font-size=3px"),
            ("path{display:a} ; }} #d{visibility:hidden}", "display=a visibility=hidden"),
        ] {
            let (found, _) = matched(css, BODY);
            let found = found.iter().find_map(|text| text.strip_prefix("d ")).unwrap_or_default();
            assert_eq!(found, expected, "{css}");
        }
    }

    #[test]
    fn matching_is_linear_in_rules_elements_and_combinators() {
        // No element is named `x`, so that trying every chain of ancestors would take 60 over 8 attempts.
        let nested = |depth: usize| format!("{}<path/>{}", "<g>".repeat(depth), "</g>".repeat(depth));
        let chain = |length: usize| format!("x {}path{{display:none}}", "g ".repeat(length));
        let (found, comparisons) = matched(&chain(8), &nested(60));
        assert!(found.is_empty() && comparisons <= 8 * 60 + 1, "{comparisons}");
        let (_, twice) = matched(&chain(16), &nested(120));
        assert!(twice <= 16 * 120 + 1, "{twice}");
        // Rules are compared only with the elements that have what they name.
        let rules: String = (0..30_000).map(|n| format!(".c{n}{{display:none}}")).collect();
        let elements: String = (0..3000).map(|n| format!("<path class='c{n} d c{n}'/>")).collect();
        let (found, comparisons) = matched(&rules, &elements);
        assert!(found.len() == 3000 && comparisons < 20_000, "{comparisons}");
    }

    #[test]
    fn too_many_comparisons_and_parts_are_refused() {
        let error = |css: String, body: String| {
            let text = format!("<svg>{body}</svg>");
            let document = Document::parse(&text).unwrap();
            let sheets = [css];
            let rules = StyleRules::parse(&sheets);
            rules.and_then(|rules| rules.matches(&document)).unwrap_err().to_string()
        };
        let rules = "*{display:none}".repeat(10_000);
        assert!(error(rules.clone(), "<g/>".repeat(3000)).contains("more than 5000000 comparisons with its elements"));
        let classes = format!("<g class='{}'/>", (0..20_000).map(|n| format!("c{n} ")).collect::<String>());
        assert!(error(rules, classes).contains("comparisons"));
        assert!(error("a,".repeat(MAX_PARTS + 2) + "b{display:none}", String::new()).contains("1000000 parts"));
    }
}
