//! Limits of the markup, checked before it is parsed: what the parser would repeat, or compare with everything else.

use std::collections::{HashMap, HashSet};

use bansho_base::host::assets::AssetProblem;

use super::damaged;
use crate::limits::TEXT_BYTES;

/// Most attributes of an element; each is compared with all others.
const MAX_ATTRIBUTES: usize = 4096;
/// Most prefixes of namespaces; each prefixed name is compared with all of them.
const MAX_PREFIXES: usize = 256;
/// Most declared namespaces times the number of their prefixes: an element that declares one copies all others.
const MAX_NAMESPACES: usize = 20_000_000;
/// Most entities; each reference is compared with all of them.
const MAX_ENTITIES: usize = 256;

/// Rejects markup that would take time or memory out of proportion to its length.
pub(super) fn check(text: &str) -> Result<(), AssetProblem> {
    check_attributes(text)?;
    check_entities(text)
}

/// Tags of so many attributes or namespaces that comparing each with all others would take seconds.
fn check_attributes(text: &str) -> Result<(), AssetProblem> {
    let (mut prefixes, mut declared) = (HashSet::new(), 0);
    for tag in text.split('<').skip(1).filter(|tag| !tag.starts_with(['!', '?', '/'])) {
        let mut attributes = 0;
        for part in unquoted(tag) {
            // What stands before a sign, back to white space, is a name.
            for (end, _) in part.match_indices('=') {
                attributes += 1;
                let name = part[..end].trim_end();
                let name = &name[name.rfind(char::is_whitespace).map_or(0, |space| space + 1)..];
                if let Some(prefix) = name.strip_prefix("xmlns") {
                    prefixes.insert(prefix);
                    declared += 1;
                }
            }
        }
        if attributes > MAX_ATTRIBUTES {
            return Err(damaged(format!("an element has more than {MAX_ATTRIBUTES} attributes")));
        }
    }
    if prefixes.len() > MAX_PREFIXES {
        return Err(damaged(format!("it has {} namespace prefixes; allowed: {MAX_PREFIXES}", prefixes.len())));
    }
    // At least one prefix where any is declared.
    if declared * prefixes.len() > MAX_NAMESPACES {
        let most = MAX_NAMESPACES / prefixes.len();
        return Err(damaged(format!("it declares namespaces {declared} times; allowed: {most} times")));
    }
    Ok(())
}

/// The parts of a tag outside of quotes, up to its end.
fn unquoted(tag: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(tag);
    std::iter::from_fn(move || {
        let text = rest?;
        let end = text.find(['"', '\'', '>']).unwrap_or(text.len());
        rest = match text.as_bytes().get(end) {
            Some(quote @ (b'"' | b'\'')) => {
                text[end + 1..].find(char::from(*quote)).map(|length| &text[end + length + 2..])
            }
            _ => None,
        };
        Some(&text[..end])
    })
}

/// An entity.
struct Entity<'a> {
    value: &'a str,
    /// Number of bytes that replace a reference, once it is known.
    expanded: Option<u64>,
}

/// Rejects text that becomes longer than a file may be once its entities are replaced.
fn check_entities(text: &str) -> Result<(), AssetProblem> {
    let mut entities: HashMap<&str, Entity> = HashMap::new();
    for declaration in text.split("<!ENTITY").skip(1) {
        let declaration = declaration.trim_start();
        let Some((name, rest)) = declaration.split_once(char::is_whitespace) else { continue };
        let rest = rest.trim_start();
        let Some(quote) = rest.chars().next().filter(|quote| matches!(quote, '"' | '\'')) else { continue };
        let Some((value, _)) = rest[1..].split_once(quote) else { continue };
        // The first declaration is the one that counts.
        entities.entry(name).or_insert(Entity { value, expanded: None });
    }
    if entities.is_empty() {
        return Ok(());
    }
    if entities.len() > MAX_ENTITIES {
        return Err(damaged(format!("it has {} entities; allowed: {MAX_ENTITIES}", entities.len())));
    }
    let mut total = text.len() as u64;
    for name in references(text) {
        total = total.saturating_add(expanded(name, &mut entities));
        if total > TEXT_BYTES {
            return Err(damaged(format!("it has more than {TEXT_BYTES} bytes once its entities are replaced")));
        }
    }
    Ok(())
}

/// The names of the entities that a text refers to.
fn references(text: &str) -> impl Iterator<Item = &str> {
    text.split('&').skip(1).filter_map(|rest| {
        // A name of more bytes than any declaration has is none.
        let end = rest.bytes().take(1 << 16).position(|byte| byte == b';' || byte == b'<' || byte == b'&')?;
        (rest.as_bytes()[end] == b';').then(|| &rest[..end])
    })
}

/// The bytes that replace a reference; 0 for one that the parser rejects or knows itself.
fn expanded<'a>(name: &'a str, entities: &mut HashMap<&'a str, Entity<'a>>) -> u64 {
    let Some(entity) = entities.get_mut(name) else { return 0 };
    if let Some(bytes) = entity.expanded {
        return bytes;
    }
    // One that refers to itself ends here; the parser rejects it.
    entity.expanded = Some(0);
    let value = entity.value;
    let inner: u64 = references(value).fold(0, |sum, inner| sum.saturating_add(expanded(inner, entities)));
    let bytes = (value.len() as u64).saturating_add(inner);
    if let Some(entity) = entities.get_mut(name) {
        entity.expanded = Some(bytes);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        check(text).unwrap_err().to_string()
    }

    #[test]
    fn attributes_are_counted_whatever_stands_in_their_values() {
        let many = |first: &str| {
            let rest: String = (0..5000).map(|n| format!(" a{n}='='")).collect();
            format!("<svg><path {first}{rest}/></svg>")
        };
        for first in ["", "a='>'", "a=\">'>\"", "a='\"' b=\"'>\""] {
            assert!(error(&many(first)).contains("more than 4096 attributes"), "{first}");
        }
        let equals = "=".repeat(9999);
        for text in ["<!-- |= -->", "<style>a|</style>", "<path d='|'/>", "<![CDATA[ | ]]>", "<?x | ?>"] {
            check(&format!("<svg>{}</svg>", text.replace('|', &equals))).unwrap();
        }
    }

    #[test]
    fn namespaces_are_bounded_by_what_elements_copy() {
        let prefixes: String = (0..300).map(|n| format!(" xmlns:a{n}='x'")).collect();
        assert!(error(&format!("<svg{prefixes}/>")).contains("300 namespace prefixes; allowed: 256"));
        let few: String = (0..200).map(|n| format!(" xmlns:a{n} = 'x'")).collect();
        let text = format!("<svg{few}>{}</svg>", "<g xmlns:a1='y'/>".repeat(100_000));
        assert!(error(&text).contains("declares namespaces 100200 times; allowed: 100000 times"), "{}", error(&text));
        check(&format!("<svg xmlns='x'>{}</svg>", "<svg xmlns='x' xmlns:xlink='y'/>".repeat(100_000))).unwrap();
    }

    #[test]
    fn what_entities_become_is_bounded() {
        let long = "x".repeat(1 << 20);
        let text = |body: &str| format!("<!DOCTYPE svg [<!ENTITY a '{long}'><!ENTITY b \"&a;&a;\">]><svg>{body}</svg>");
        check(&text(&"&a;".repeat(50))).unwrap();
        assert!(error(&text(&"&a;".repeat(70))).contains("once its entities are replaced"));
        assert!(error(&text(&"&b;".repeat(35))).contains("once its entities are replaced"));
        let many: String = (0..300).map(|n| format!("<!ENTITY a{n} 'x'>")).collect();
        assert!(error(&format!("<!DOCTYPE svg [{many}]><svg/>")).contains("300 entities; allowed: 256"));
        // One that refers to itself is the parser's to reject.
        check("<!DOCTYPE svg [<!ENTITY a '&a;'>]><svg>&a;</svg>").unwrap();
    }
}
