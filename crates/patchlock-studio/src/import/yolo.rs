//! YOLO: a text for each image, of the same name, with `class centre-x centre-y width height` on each
//! line, relative to the frame; and the names of the classes. Lines may end with a score.

use patchlock::BoundingBox;

use super::images::Numbers;
use super::{File, ImportBuilder, Outcome, Row, text_of};

/// Reads all files.
pub fn read(files: &[File], found: &mut ImportBuilder<'_>) -> Outcome {
    let mut classes = Vec::new();
    let mut labels = Vec::new();
    for file in files {
        let name = file.name.rsplit(['/', '\\']).next().unwrap_or_default();
        let text = text_of(&file.content).map_err(|reason| format!("{}: {reason}", file.name))?;
        match name.rsplit_once('.').map_or("", |(_, end)| end) {
            "yaml" | "yml" => classes = names_of_yaml(text),
            "names" => classes = lines(text),
            "txt" if name == "classes.txt" || name == "labels.txt" => classes = lines(text),
            "txt" if !is_list(text) => labels.push((file, text)),
            _ => {}
        }
    }
    if labels.is_empty() {
        return Err(
            "there is no text file with boxes; choose those of all images, and the one with \
                    the names of the classes"
                .to_owned(),
        );
    }
    let names = labels.iter().map(|(file, _)| file.name.as_str());
    let numbers = (!found.images.have_names())
        .then(|| Numbers::new(names, found.video.frames))
        .transpose()?;
    for (file, text) in &labels {
        let wrong = |reason: String| format!("{}: {reason}", file.name);
        if text.trim().is_empty() {
            continue;
        }
        let frame = match &numbers {
            Some(numbers) => numbers.frame(&file.name),
            None => found.images.named(&file.name),
        };
        let frame = frame.map_err(wrong)?;
        for (k, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let at_line = |reason: String| wrong(format!("line {}: {reason}", k + 1));
            match row(line, frame, &classes, found).map_err(at_line)? {
                Some(row) => found.add(&row).map_err(at_line)?,
                None => found.leave_out("polygon"),
            }
        }
    }
    found.notes.extend(numbers.map(|numbers| numbers.note));
    Ok(())
}

/// Whether a text is a list of images, such as `train.txt`.
fn is_list(text: &str) -> bool {
    let first = text.split_whitespace().next();
    first.is_some_and(|word| word.parse::<f64>().is_err())
}

/// The box of a line; `None` if it is a polygon.
fn row(
    line: &str,
    frame: usize,
    classes: &[String],
    found: &ImportBuilder<'_>,
) -> Outcome<Option<Row>> {
    let cells: Vec<&str> = line.split_whitespace().collect();
    let number = |k: usize| {
        let cell = cells[k];
        cell.parse::<f64>().map_err(|_| format!("column {} is {cell:?}, not a number", k + 1))
    };
    match cells.len() {
        5 | 6 => {}
        count if count >= 7 && count % 2 == 1 => return Ok(None),
        count => {
            return Err(format!(
                "there are {count} columns; a box has five or six: class, centre x and y, \
                                width, height and a score"
            ));
        }
    }
    let class: usize =
        cells[0].parse().map_err(|_| format!("the class is {:?}, not a whole number", cells[0]))?;
    let (width, height) = (found.video.width as f64, found.video.height as f64);
    let (w, h) = (number(3)? * width, number(4)? * height);
    let bbox =
        BoundingBox { x: number(1)? * width - w / 2.0, y: number(2)? * height - h / 2.0, w, h };
    let score = if cells.len() > 5 { Some(number(5)?) } else { None };
    let label = classes.get(class).cloned().unwrap_or_else(|| format!("class {class}"));
    let score = score.filter(|score| (0.0..=1.0).contains(score));
    Ok(Some(Row { frame, label: Some(label), bbox: Some(bbox), score, ..Row::default() }))
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(|line| line.trim().to_owned()).collect()
}

/// The names of `data.yaml`: a list in one line, or a line for each, with its number or a dash.
fn names_of_yaml(text: &str) -> Vec<String> {
    // A text in double quotes is that of JSON, in which we write names.
    let bare = |name: &str| {
        let name = name.trim();
        serde_json::from_str(name).unwrap_or_else(|_| name.trim_matches(['"', '\'']).to_owned())
    };
    let mut rest = text.lines().skip_while(|line| !line.starts_with("names:"));
    let first = rest.next().and_then(|line| line.strip_prefix("names:")).unwrap_or_default().trim();
    if let Some(list) = first.strip_prefix('[') {
        if let Ok(names) = serde_json::from_str(first) {
            return names;
        }
        return list.trim_end_matches(']').split(',').map(bare).collect();
    }
    let is_entry = |line: &&str| line.starts_with([' ', '-']) && !line.trim().is_empty();
    let entry = |line: &str| {
        let line = line.trim();
        match line.strip_prefix('-') {
            Some(name) => bare(name),
            None => bare(line.split_once(':').map_or(line, |(_, name)| name)),
        }
    };
    rest.take_while(is_entry).map(entry).collect()
}
