//! What is checked in the text of a URDF before urdf-rs reads it.
//!
//! The XML reader recurses, so depth is bounded here; and urdf-rs leaves out what is no number in a vector, so
//! that `"0.5m 0 0 1"` would be read as `(0, 0, 1)`. A kind of joint or shape that URDF does not have is named
//! here with its joint or link, which the reader's message does not do.

/// Deepest nesting of elements that is read; URDF needs six.
const MAX_NESTING: usize = 100;

/// Attributes of three numbers.
const VECTORS: [&str; 3] = ["xyz", "rpy", "size"];

/// Kinds of joints that urdf-rs reads.
const JOINTS: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

/// Kinds of shapes that urdf-rs reads.
const SHAPES: [&str; 5] = ["box", "cylinder", "capsule", "sphere", "mesh"];

/// Err with a message for people if the text must not be given to the XML reader.
pub fn check(text: &str) -> Result<(), String> {
    let mut depth = 0_usize;
    let mut rest = text;
    let (mut link, mut in_geometry) = ("", false);
    while let Some((tag, after)) = next_tag(rest) {
        rest = after;
        let element = tag.split(|c: char| c.is_whitespace() || c == '/').next().unwrap_or("");
        if std::mem::replace(&mut in_geometry, element == "geometry" && !tag.ends_with('/'))
            && !element.is_empty()
            && !SHAPES.contains(&element)
        {
            return Err(format!(
                "link `{link}` has a shape `{element}`; use box, cylinder, sphere or capsule"
            ));
        }
        if tag.starts_with('/') {
            depth = depth.saturating_sub(1);
            continue;
        }
        let attributes = attributes(tag);
        let find = |name: &str| attributes.iter().find(|(found, _)| *found == name).map(|(_, value)| *value);
        match (element, find("name"), find("type")) {
            ("link", Some(name), _) => link = name,
            ("joint", Some(name), Some(kind)) if !JOINTS.contains(&kind) => {
                return Err(format!(
                    "joint `{name}` has the kind `{kind}`; use revolute, continuous, prismatic, planar or fixed"
                ));
            }
            _ => {}
        }
        for &(name, value) in &attributes {
            let numbers = value.split_whitespace().map(str::parse::<f64>);
            if VECTORS.contains(&name)
                && (numbers.clone().count() != 3 || numbers.clone().any(|n| n.is_err()))
            {
                return Err(format!(
                    "{name} = \"{}\" is not three numbers",
                    value.replace(['\n', '\r'], " ")
                ));
            }
        }
        if !tag.ends_with('/') {
            depth += 1;
        }
        if depth > MAX_NESTING {
            return Err(format!("elements are nested more than {MAX_NESTING} deep"));
        }
    }
    Ok(())
}

/// The next tag, without its angle brackets, and the text after it. Comments, declarations, processing
/// instructions and character data are skipped.
fn next_tag(text: &str) -> Option<(&str, &str)> {
    let mut rest = text;
    loop {
        rest = &rest[rest.find('<')? + 1..];
        let skipped = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>"), ("!", ">")];
        match skipped.iter().find(|(start, _)| rest.starts_with(start)) {
            Some((start, end)) => {
                let inner = &rest[start.len()..];
                rest = &inner[inner.find(end)? + end.len()..];
            }
            None => break,
        }
    }
    let mut quote = None;
    for (position, c) in rest.char_indices() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            (None, '>') => return Some((&rest[..position], &rest[position + 1..])),
            _ => {}
        }
    }
    None
}

/// Names and values of a tag's attributes.
fn attributes(tag: &str) -> Vec<(&str, &str)> {
    let mut attributes = Vec::new();
    let mut rest = tag;
    while let Some(open) = rest.find(['"', '\'']) {
        let name = rest[..open].trim_end().trim_end_matches('=').split_whitespace().last().unwrap_or("");
        let inner = &rest[open + 1..];
        let Some(close) = inner.find(&rest[open..=open]) else { break };
        attributes.push((name, &inner[..close]));
        rest = &inner[close + 1..];
    }
    attributes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_have_three_numbers() {
        assert_eq!(check("<a xyz=\"0 0 1\" rpy = '1 2 -3e-4'/>"), Ok(()));
        for value in ["0 0", "0.5m 0 0 1", "0 0 x", "0 0 0 0", ""] {
            let message = check(&format!("<robot><origin rpy=\"0 0 0\" xyz='{value}'/>")).unwrap_err();
            assert_eq!(message, format!("xyz = \"{value}\" is not three numbers"));
        }
        assert_eq!(check("<!-- xyz=\"1\" <a xyz=\"1\"> --><a name='xyz=\"1\"'/>"), Ok(()));
    }

    #[test]
    fn depth_is_counted_by_elements() {
        let flat = "<a b='/>' c=\"</\">< /a></a><?x <?><!-- <a> -->".repeat(1000);
        assert!(check(&"<a b='/></a>'>".repeat(101)).is_err());
        assert_eq!(check(&"<a>".repeat(100)), Ok(()));
        assert!(check(&flat).is_err(), "`< /a>` opens");
        assert_eq!(check(&"<a><b/></a><!-- <a> -->".repeat(1000)), Ok(()));
    }

    #[test]
    fn unknown_kinds_are_named() {
        let message = check("<robot><joint type='screw' name='lid'>").unwrap_err();
        assert!(message.starts_with("joint `lid` has the kind `screw`; use revolute"), "{message}");
        let cone = "<link name=\"hat\"><collision><geometry> <cone radius=\"1\"/></geometry>";
        assert!(check(cone).unwrap_err().starts_with("link `hat` has a shape `cone`; use box"));
        assert_eq!(check("<transmission><joint name='lid'/></transmission>"), Ok(()));
        assert_eq!(check("<geometry></geometry>"), Ok(()), "left to the reader");
        assert_eq!(check("<geometry><sphere radius='1'/></geometry>"), Ok(()));
    }

    #[test]
    fn text_that_ends_early_is_left_to_the_reader() {
        for text in ["", "<", "<!--", "<a b=\"", "<a b='x\"", "a > b", "<![CDATA["] {
            assert_eq!(check(text), Ok(()), "{text}");
        }
    }
}
