//! Reads XML as trees, one part of the outermost element at a time, in a time and memory that follow
//! its length.

use std::borrow::Cow;

use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::Outcome;

/// Most attributes of an element, and most bytes of the value of one.
const MOST: (usize, usize) = (100, 1000);
/// Most elements that are open at once. A tree is dropped by functions that call themselves.
const DEPTH: usize = 100;
/// Most elements of a part.
const ELEMENTS: usize = 5_000_000;

/// An element with all that is in it.
pub struct Element<'a> {
    start: BytesStart<'a>,
    /// The text directly within it, without spaces around it.
    pub text: String,
    /// The elements directly within it.
    pub children: Vec<Element<'a>>,
    /// The line in which it begins, from 1.
    line: usize,
}

impl Element<'_> {
    /// Its name, without a namespace.
    pub fn name(&self) -> &str {
        self.start.local_name().into_inner()
    }

    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<Cow<'_, str>> {
        let mut attributes = self.start.attributes();
        attributes.with_checks(false);
        let found = attributes.flatten().find(|it| it.key.as_ref() == name)?;
        found.normalized_value(XmlVersion::Implicit1_0).ok()
    }

    /// The texts of the last element of each of these names directly within it.
    pub fn texts<const N: usize>(&self, names: [&str; N]) -> [Option<&str>; N] {
        names.map(|name| {
            let last = self.children.iter().rfind(|child| child.name() == name);
            last.map(|child| child.text.as_str())
        })
    }

    /// The elements of this name within it, but none within one of them.
    pub fn find(&self, name: &str) -> Vec<&Self> {
        let mut found = Vec::new();
        for child in &self.children {
            match child.name() == name {
                true => found.push(child),
                false => found.extend(child.find(name)),
            }
        }
        found
    }

    /// The reason of an error, with the line in which the element begins.
    pub fn in_line(&self, reason: impl std::fmt::Display) -> String {
        format!("line {}: {reason}", self.line)
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
    /// How many elements the part has.
    elements: usize,
    /// Where the last element begins, in bytes, and in which line.
    last: (usize, usize),
}

/// What comes next.
enum XmlToken<'a> {
    Begin(Element<'a>),
    Text(String),
    /// The end of an element, or of the text.
    End,
}

impl<'a> Xml<'a> {
    /// A text up to the beginning of the outermost element, which must have this name.
    pub fn new(text: &'a str, name: &str) -> Outcome<Self> {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        let mut xml = Self { text, reader, depth: 0, begun: false, elements: 0, last: (0, 1) };
        let root = loop {
            match xml.next()? {
                XmlToken::Begin(root) => break root,
                XmlToken::Text(_) => {}
                XmlToken::End => return Err(xml.wrong("it has no element")),
            }
        };
        ensure!(root.name() == name, "the file begins with <{}>, not <{name}>", root.name());
        Ok(xml)
    }

    /// The next element directly within the outermost one; `None` at its end, and after that at the
    /// end of the text.
    pub fn part(&mut self) -> Outcome<Option<Element<'a>>> {
        self.elements = 0;
        loop {
            match self.next()? {
                XmlToken::Begin(part) => return self.whole(part).map(Some),
                XmlToken::Text(_) => {}
                XmlToken::End => return Ok(None),
            }
        }
    }

    /// An element that has begun, read to its end.
    fn whole(&mut self, mut element: Element<'a>) -> Outcome<Element<'a>> {
        self.elements += 1;
        if self.depth > DEPTH || self.elements > ELEMENTS {
            let most = format!("{DEPTH} elements within each other, or {ELEMENTS} in one");
            return Err(element.in_line(format!("there are more than {most}")));
        }
        loop {
            match self.next()? {
                XmlToken::Begin(child) => element.children.push(self.whole(child)?),
                XmlToken::Text(more) => element.text += &more,
                XmlToken::End => break,
            }
        }
        element.text = element.text.trim().to_owned();
        Ok(element)
    }

    /// The error for a text that is not XML from here on.
    fn wrong(&self, reason: impl std::fmt::Display) -> String {
        let line = self.line_at(self.reader.buffer_position() as usize);
        format!("the file is not XML: line {line}: {reason}")
    }

    /// The line of a place that is not before the last element.
    fn line_at(&self, at: usize) -> usize {
        let (before, line) = self.last;
        line + self.text.bytes().take(at).skip(before).filter(|byte| *byte == b'\n').count()
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
                    return self.element(start, at).map(XmlToken::Begin);
                }
                Event::End(_) => {
                    self.depth -= 1;
                    return Ok(XmlToken::End);
                }
                Event::Eof if self.depth > 0 => return Err(self.wrong("an element has no end")),
                Event::Eof => return Ok(XmlToken::End),
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

    /// An element that begins, whose attributes can be read.
    fn element(&mut self, start: BytesStart<'a>, at: usize) -> Outcome<Element<'a>> {
        let line = self.line_at(at);
        for (k, attribute) in start.attributes().enumerate() {
            let attribute = attribute.map_err(|error| self.wrong(error))?;
            if k == MOST.0 || attribute.value.len() > MOST.1 {
                return Err(format!(
                    "line {line}: an element has more than {} attributes, or one of more than {} bytes",
                    MOST.0, MOST.1
                ));
            }
            let value = attribute.normalized_value(XmlVersion::Implicit1_0);
            value.map_err(|error| self.wrong(error))?;
        }
        self.last = (at, line);
        Ok(Element { start, text: String::new(), children: Vec::new(), line })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_and_texts_come_in_order() {
        let text = "<?xml version=\"1.0\"?>\n<!-- a --><a>x<b c='1 &lt; 2' n:d=\"\"/>\n<b> y &amp;\
                    <c>no</c> &#65;<![CDATA[<&]]> </b></a>\n";
        let mut xml = Xml::new(text, "a").unwrap();
        let first = xml.part().unwrap().unwrap();
        assert_eq!((first.attribute("c").as_deref(), first.attribute("d")), (Some("1 < 2"), None));
        assert_eq!((first.line, first.text.as_str()), (2, ""));
        let second = xml.part().unwrap().unwrap();
        assert_eq!((second.name(), second.line), ("b", 3));
        assert_eq!(second.text, "y & A<&");
        assert_eq!(second.texts(["b", "c"]), [None, Some("no")]);
        assert_eq!(second.find("c")[0].text, "no");
        assert!(xml.part().unwrap().is_none() && xml.part().unwrap().is_none());
    }

    #[test]
    fn what_is_no_xml_is_refused_with_its_line() {
        let said = |text: &str| {
            let read = || -> Outcome {
                let mut xml = Xml::new(text, "a")?;
                while xml.part()?.is_some() {}
                xml.part().map(|_| ())
            };
            read().unwrap_err()
        };
        for (text, words) in [
            ("", "line 1: it has no element"),
            ("words", "there is text outside of the elements"),
            ("<b/>", "the file begins with <b>, not <a>"),
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
        let deep = said(&"<a>\n".repeat(1_000_000));
        assert_eq!(
            deep,
            "line 101: there are more than 100 elements within each other, or 5000000 in one"
        );
    }
}
