//! A minimal XML tokenizer for drawings: tags with their attributes.

/// An event of the tokenizer. Text, comments and declarations are skipped.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Event<'a> {
    /// A tag opens.
    Start(Tag<'a>),
    /// A tag closes; also follows each empty tag.
    End,
}

/// An opening tag.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tag<'a> {
    /// Its name without a namespace.
    pub(super) name: &'a str,
    attributes: Vec<(&'a str, &'a str)>,
}

impl Tag<'_> {
    /// The value of an attribute, verbatim: entities are not resolved, since neither numbers nor ids need them.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| *key == name).map(|(_, value)| *value)
    }
}

/// Why a text is not XML.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum XmlError {
    #[error("a tag, comment or declaration does not end")]
    Unended,
    #[error("an attribute has no value in quotes")]
    NoValue,
}

/// Reads events one after another.
#[derive(Debug)]
pub(super) struct Events<'a> {
    rest: &'a str,
    /// Whether the tag that was just read was empty, so that its end is next.
    is_empty_tag: bool,
}

impl<'a> Events<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text, is_empty_tag: false }
    }

    /// The text before the next `end`; continues after it.
    fn until(&mut self, end: &str) -> Result<&'a str, XmlError> {
        let (before, after) = self.rest.split_once(end).ok_or(XmlError::Unended)?;
        self.rest = after;
        Ok(before)
    }

    /// The next event; none at the end of the text.
    pub(super) fn next(&mut self) -> Result<Option<Event<'a>>, XmlError> {
        if std::mem::take(&mut self.is_empty_tag) {
            return Ok(Some(Event::End));
        }
        while let Some((_, after)) = self.rest.split_once('<') {
            self.rest = after;
            if let Some(after) = after.strip_prefix("!--") {
                self.rest = after;
                self.until("-->")?;
            } else if let Some(after) = after.strip_prefix("![CDATA[") {
                self.rest = after;
                self.until("]]>")?;
            } else if after.starts_with('?') {
                self.until("?>")?;
            } else if after.starts_with('!') {
                self.declaration()?;
            } else if after.starts_with('/') {
                self.until(">")?;
                return Ok(Some(Event::End));
            } else {
                return self.tag().map(|tag| Some(Event::Start(tag)));
            }
        }
        Ok(None)
    }

    /// A document type may hold declarations of its own in brackets.
    fn declaration(&mut self) -> Result<(), XmlError> {
        let end = self.rest.find('>').ok_or(XmlError::Unended)?;
        // Only the text before the end is searched: searching the rest for each of many declarations would take quadratic time.
        if self.rest[..end].contains('[') {
            self.until("]")?;
        }
        self.until(">").map(|_| ())
    }

    fn tag(&mut self) -> Result<Tag<'a>, XmlError> {
        let name = self.name();
        let mut attributes = Vec::new();
        loop {
            self.rest = self.rest.trim_start();
            if let Some(after) = self.rest.strip_prefix("/>") {
                self.rest = after;
                self.is_empty_tag = true;
                break;
            }
            if let Some(after) = self.rest.strip_prefix('>') {
                self.rest = after;
                break;
            }
            attributes.push(self.attribute()?);
        }
        Ok(Tag { name: name.rsplit_once(':').map_or(name, |(_, name)| name), attributes })
    }

    fn attribute(&mut self) -> Result<(&'a str, &'a str), XmlError> {
        let name = self.name();
        if name.is_empty() {
            return Err(if self.rest.is_empty() { XmlError::Unended } else { XmlError::NoValue });
        }
        let after = self.rest.trim_start().strip_prefix('=').ok_or(XmlError::NoValue)?.trim_start();
        let quote = if after.starts_with('"') { "\"" } else { "'" };
        self.rest = after.strip_prefix(quote).ok_or(XmlError::NoValue)?;
        Ok((name, self.until(quote)?))
    }

    /// The characters up to one that ends a name.
    fn name(&mut self) -> &'a str {
        let ends =
            |character: char| character.is_whitespace() || matches!(character, '=' | '>' | '/' | '"' | '\'' | '<');
        let (name, rest) = self.rest.split_at(self.rest.find(ends).unwrap_or(self.rest.len()));
        self.rest = rest;
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Result<Vec<String>, XmlError> {
        let mut events = Events::new(text);
        let mut names = Vec::new();
        while let Some(event) = events.next()? {
            names.push(match event {
                Event::Start(tag) => tag.name.to_owned(),
                Event::End => "end".to_owned(),
            });
        }
        Ok(names)
    }

    #[test]
    fn tags_come_in_order_and_all_else_is_passed_over() {
        let text = "<?xml version='1.0'?><!DOCTYPE svg [ <!ENTITY a \"b\"> ]><svg:svg a = '1>2'>\
            text<!-- <path/> --><path d=\"M0 0\"/><![CDATA[<g>]]></svg:svg>";
        assert_eq!(names(text).unwrap(), ["svg", "path", "end", "end"]);
    }

    #[test]
    fn many_declarations_take_time_by_their_number() {
        // Minutes if each were to search the rest of the text.
        let text = format!("{}<svg/>", "<!a>".repeat(1_000_000));
        let begun = std::time::Instant::now();
        assert_eq!(names(&text).unwrap(), ["svg", "end"]);
        assert!(begun.elapsed().as_secs_f64() < 2.0, "{:?}", begun.elapsed());
    }

    #[test]
    fn attributes_are_found_by_name() {
        let Ok(Some(Event::Start(tag))) = Events::new("<path id='left' d=\"M 0 0\nL 1 1\"/>").next() else { panic!() };
        assert_eq!((tag.get("id"), tag.get("d"), tag.get("x")), (Some("left"), Some("M 0 0\nL 1 1"), None));
    }

    #[test]
    fn broken_texts_are_errors() {
        for (text, error) in [
            ("<svg", XmlError::Unended),
            ("<!-- ", XmlError::Unended),
            ("<svg a>", XmlError::NoValue),
            ("<svg a=1>", XmlError::NoValue),
            ("<svg a='1>", XmlError::Unended),
            ("<svg <g>", XmlError::NoValue),
        ] {
            assert_eq!(names(text), Err(error), "{text}");
        }
    }
}
