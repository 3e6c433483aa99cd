//! Reads XML one element after another, in a time and memory that follow its length.

use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::Outcome;

/// Most attributes of an element that is looked at, and most bytes of the value of one.
const MOST: (usize, usize) = (100, 1000);

/// An element that begins.
pub struct Element {
    /// Its name, without a namespace.
    pub name: String,
    attributes: Vec<(String, String)>,
    /// Where it begins, in bytes.
    at: usize,
}

impl Element {
    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// A text of XML that is read from its beginning to its end.
pub struct Xml<'a> {
    text: &'a str,
    reader: Reader<&'a [u8]>,
    /// How many elements are open.
    depth: usize,
    /// Whether the outermost element has begun.
    begun: bool,
}

/// What comes next.
enum XmlToken<'a> {
    Begin(BytesStart<'a>, usize),
    End,
    Text(String),
    /// The end of the text.
    Nothing,
}

impl<'a> Xml<'a> {
    /// The beginning of a text.
    pub fn new(text: &'a str) -> Self {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        Self { text, reader, depth: 0, begun: false }
    }

    /// The outermost element.
    pub fn root(&mut self) -> Outcome<Element> {
        match self.child()? {
            Some(root) => Ok(root),
            None => Err(self.wrong("it has no element")),
        }
    }

    /// The next element within the open one, without the text before it; `None` if the open one
    /// ends. The element is open then: it has to be read to its end.
    pub fn child(&mut self) -> Outcome<Option<Element>> {
        loop {
            match self.next()? {
                XmlToken::Begin(start, at) => return self.element(&start, at).map(Some),
                XmlToken::End | XmlToken::Nothing => return Ok(None),
                XmlToken::Text(_) => {}
            }
        }
    }

    /// The text directly within the open element, which is read to its end.
    pub fn text(&mut self) -> Outcome<String> {
        let (outer, mut text) = (self.depth, String::new());
        while self.depth >= outer {
            match self.next()? {
                XmlToken::Text(more) if self.depth == outer => text += &more,
                _ => {}
            }
        }
        Ok(text.trim().to_owned())
    }

    /// Reads the open element to its end. The texts of elements directly within it that have one of
    /// these names are taken, with the place of the name.
    pub fn texts(
        &mut self,
        names: &[&str],
        mut take: impl FnMut(usize, String) -> Outcome,
    ) -> Outcome {
        while let Some(child) = self.child()? {
            let place = names.iter().position(|name| *name == child.name);
            let text = self.text()?;
            if let Some(place) = place {
                take(place, text)?;
            }
        }
        Ok(())
    }

    /// Reads on to the end of the outermost of this many open elements, or to the beginning of the
    /// next element in it with one of these names, which is returned.
    pub fn find(&mut self, depth: usize, names: &[&'static str]) -> Outcome<Option<&'static str>> {
        while self.depth >= depth {
            if let XmlToken::Begin(start, _) = self.next()?
                && let Some(name) = names.iter().find(|name| **name == start.local_name().as_ref())
            {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }

    /// Reads on to the end of the outermost of this many open elements.
    pub fn close_to(&mut self, depth: usize) -> Outcome {
        while self.depth > depth {
            self.next()?;
        }
        Ok(())
    }

    /// How many elements are open.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// The line in which an element begins. It counts the lines before it, so it is asked only for
    /// errors.
    fn line_of(&self, element: &Element) -> usize {
        self.line_at(element.at)
    }

    /// The reason of an error, with the line in which an element begins.
    pub fn in_line(&self, element: &Element, reason: String) -> String {
        format!("line {}: {reason}", self.line_of(element))
    }

    fn line_at(&self, at: usize) -> usize {
        1 + self.text.bytes().take(at).filter(|byte| *byte == b'\n').count()
    }

    /// The error for a text that is not XML from here on.
    fn wrong(&self, reason: impl std::fmt::Display) -> String {
        let line = self.line_at(self.reader.buffer_position() as usize);
        format!("the file is not XML: line {line}: {reason}")
    }

    fn next(&mut self) -> Outcome<XmlToken<'a>> {
        loop {
            let at = self.reader.buffer_position() as usize;
            let event = self.reader.read_event().map_err(|error| self.wrong(error))?;
            let text = match event {
                Event::Start(_) if self.depth == 0 && self.begun => {
                    return Err(self.wrong("a second outermost element begins"));
                }
                Event::Start(start) => {
                    (self.depth, self.begun) = (self.depth + 1, true);
                    return Ok(XmlToken::Begin(start, at));
                }
                Event::End(_) => {
                    self.depth -= 1;
                    return Ok(XmlToken::End);
                }
                Event::Eof if self.depth > 0 => return Err(self.wrong("an element has no end")),
                Event::Eof => return Ok(XmlToken::Nothing),
                Event::Text(text) => text.xml10_content().into_owned(),
                Event::CData(text) => text.xml10_content().into_owned(),
                Event::GeneralRef(name) => match name.resolve_char_ref() {
                    Ok(Some(character)) => character.to_string(),
                    Ok(None) => match resolve_xml_entity(&name) {
                        Some(text) => text.to_owned(),
                        None => return Err(self.wrong(format!("&{}; is unknown", &*name))),
                    },
                    Err(error) => return Err(self.wrong(error)),
                },
                // Its entities could make a long text of a short one.
                Event::DocType(_) => return Err(self.wrong("a document type is not allowed")),
                Event::Comment(_) | Event::PI(_) | Event::Decl(_) | Event::Empty(_) => continue,
            };
            if self.depth == 0 && !text.trim().is_empty() {
                return Err(self.wrong("there is text outside of the elements"));
            }
            return Ok(XmlToken::Text(text));
        }
    }

    fn element(&self, start: &BytesStart<'_>, at: usize) -> Outcome<Element> {
        let mut attributes = Vec::new();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|error| self.wrong(error))?;
            let key = attribute.key.as_ref().to_owned();
            let bytes = attribute.value.len();
            if attributes.len() == MOST.0 || bytes > MOST.1 {
                let line = self.line_at(at);
                return Err(format!(
                    "line {line}: an element has more than {} attributes, or one of more than {} bytes",
                    MOST.0, MOST.1
                ));
            }
            let value = attribute.normalized_value(XmlVersion::Implicit1_0);
            attributes.push((key, value.map_err(|error| self.wrong(error))?.into_owned()));
        }
        let name = start.local_name().as_ref().to_owned();
        Ok(Element { name, attributes, at })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_and_texts_come_in_order() {
        let text = "<?xml version=\"1.0\"?>\n<!-- a --><a>x<b c='1 &lt; 2' n:d=\"\"/>\n<b> y &amp;\
                    <c>no</c> &#65;<![CDATA[<&]]> </b></a>\n";
        let mut xml = Xml::new(text);
        assert_eq!(xml.root().unwrap().name, "a");
        let first = xml.child().unwrap().unwrap();
        assert_eq!((first.attribute("c"), first.attribute("d")), (Some("1 < 2"), None));
        assert_eq!(xml.line_of(&first), 2);
        assert_eq!(xml.text().unwrap(), "");
        let second = xml.child().unwrap().unwrap();
        assert_eq!((second.name.as_str(), xml.line_of(&second)), ("b", 3));
        assert_eq!(xml.text().unwrap(), "y & A<&");
        assert!(xml.child().unwrap().is_none() && xml.child().unwrap().is_none());
    }

    #[test]
    fn what_is_no_xml_is_refused_with_its_line() {
        let said = |text: &str| {
            let mut xml = Xml::new(text);
            let mut read = || -> Outcome {
                xml.root()?;
                xml.close_to(0)?;
                xml.child().map(|_| ())
            };
            read().unwrap_err()
        };
        for (text, words) in [
            ("", "line 1: it has no element"),
            ("words", "there is text outside of the elements"),
            ("<a>", "an element has no end"),
            ("<a>\n<b></a>", "line 2: "),
            ("<a/><b/>", "a second outermost element begins"),
            ("<a/>\n&#65;", "line 2: there is text outside"),
            ("<a>&b;</a>", "&b; is unknown"),
            ("<!DOCTYPE a [<!ENTITY b \"c\">]><a/>", "a document type is not allowed"),
            ("<a b='1' b='2'/>", "the file is not XML: line 1: "),
        ] {
            let error = said(text);
            assert!(error.contains(words), "{text}: {error}");
        }
        let many: String = (0..101).map(|k| format!(" a{k}=''")).collect();
        assert!(said(&format!("<a{many}/>")).contains("more than 100 attributes"));
        let long = "x".repeat(1001);
        assert!(said(&format!("<a b='{long}'/>")).contains("more than 1000 bytes"));
    }
}
