//! XML documents with one element a line.

use std::borrow::Cow;

use quick_xml::Writer;
use quick_xml::escape::escape;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An XML document in memory. Writing to memory does not fail, and the results of the writer are
/// not looked at.
pub struct Document {
    writer: Writer<Vec<u8>>,
}

impl Document {
    pub fn new() -> Self {
        Self { writer: Writer::new_with_indent(Vec::new(), b' ', 2) }
    }

    /// Writes the line that says that this is XML, in UTF-8.
    pub fn declare(&mut self) {
        self.write(Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None)));
    }

    /// Writes an element with other elements inside.
    pub fn element(
        &mut self,
        name: &str,
        attributes: &[(&str, &str)],
        inside: impl FnOnce(&mut Self),
    ) {
        let attributes = attributes.iter().map(|&(name, value)| (name, legal(value)));
        self.write(Event::Start(BytesStart::new(name).with_attributes(attributes)));
        inside(self);
        self.write(Event::End(BytesEnd::new(name)));
    }

    /// Writes an element with text inside, which may be empty.
    pub fn leaf(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) {
        let text = escape(legal(text)).replace('\n', "&#10;").replace('\t', "&#9;");
        self.element(name, attributes, |xml| {
            xml.write(Event::Text(BytesText::from_escaped(text)));
        });
    }

    /// The document, with a line end after the last line.
    pub fn into_text(self) -> String {
        let mut text = String::from_utf8_lossy(&self.writer.into_inner()).into_owned();
        text.push('\n');
        text
    }

    fn write(&mut self, event: Event<'_>) {
        let _ = self.writer.write_event(event);
    }
}

/// A truth value as 0 or 1.
pub fn digit(value: bool) -> &'static str {
    if value { "1" } else { "0" }
}

/// Replaces characters that XML cannot have.
fn legal(text: &str) -> Cow<'_, str> {
    let is_illegal = |c: char| match c {
        '\t' | '\n' | '\r' => false,
        _ => c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'),
    };
    if text.contains(is_illegal) {
        Cow::Owned(text.replace(is_illegal, "\u{fffd}"))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use super::Document;

    #[test]
    fn a_document_has_one_element_a_line() {
        let mut xml = Document::new();
        xml.declare();
        xml.element("a", &[("b", "1"), ("c", "2")], |xml| {
            xml.leaf("d", &[], "3");
            xml.leaf("e", &[], "");
        });
        assert_eq!(
            xml.into_text(),
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<a b=\"1\" c=\"2\">\n  <d>3</d>\n  <e></e>\n</a>\n"
        );
    }

    #[test]
    fn text_and_attributes_are_escaped() {
        let mut xml = Document::new();
        xml.leaf("a", &[("b", "<&>\"\n\t\r\u{7}é")], "<&>\n\t\r\u{7}\u{ffff}é");
        assert_eq!(
            xml.into_text(),
            "<a b=\"&lt;&amp;&gt;&quot;&#10;&#9;&#13;\u{fffd}é\">&lt;&amp;&gt;&#10;&#9;&#13;\u{fffd}\u{fffd}é</a>\n"
        );
    }
}
