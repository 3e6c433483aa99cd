//! YOLO: a text for each image, of the same name, with `class centre-x centre-y width height` on each
//! line, relative to the frame; and the names of the classes. Such lines may end with a score. A
//! rotated box or a polygon has its corners after the class.

use patchlock::BoundingBox;

use super::{File, ImportBuilder, Outcome, Outline, Row, text_of};

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
    found.number_images(labels.iter().map(|(file, _)| file.name.as_str()))?;
    for (file, text) in &labels {
        let wrong = |reason: String| format!("{}: {reason}", file.name);
        if text.trim().is_empty() {
            continue;
        }
        let frame = found.images.frame(&file.name).map_err(wrong)?;
        for (k, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let at_line = |reason: String| wrong(format!("line {}: {reason}", k + 1));
            let row = row(line, frame, &classes, found).map_err(at_line)?;
            found.add(&row).map_err(at_line)?;
        }
    }
    Ok(())
}

/// Whether a text is a list of images, such as `train.txt`.
fn is_list(text: &str) -> bool {
    let first = text.split_whitespace().next();
    first.is_some_and(|word| word.parse::<f64>().is_err())
}

/// What a line says.
fn row(line: &str, frame: usize, classes: &[String], found: &ImportBuilder<'_>) -> Outcome<Row> {
    let (class, cells) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let class: usize =
        class.parse().map_err(|_| format!("the class is {class:?}, not a whole number"))?;
    let number = |(k, cell): (usize, &str)| {
        cell.parse::<f64>().map_err(|_| format!("column {} is {cell:?}, not a number", k + 2))
    };
    let numbers = cells.split_whitespace().enumerate().map(number);
    let numbers = numbers.collect::<Outcome<Vec<f64>>>()?;
    let (width, height) = (found.video.width as f64, found.video.height as f64);
    let label = classes.get(class).cloned().unwrap_or_else(|| format!("class {class}"));
    let row = Row { frame, label: Some(label), ..Row::default() };
    match numbers[..] {
        [x, y, w, h] | [x, y, w, h, _] => {
            let (w, h) = (w * width, h * height);
            let bbox = BoundingBox { x: x * width - w / 2.0, y: y * height - h / 2.0, w, h };
            let score = numbers.get(4).copied().filter(|score| (0.0..=1.0).contains(score));
            Ok(Row { bbox: Some(bbox), score, ..row })
        }
        _ if numbers.len() >= 6 && numbers.len() % 2 == 0 => {
            let (points, _) = numbers.as_chunks::<2>();
            let outline = Outline(points.iter().map(|[x, y]| [x * width, y * height]).collect());
            Ok(Row { bbox: Some(outline.bounds()), outline: Some(outline), ..row })
        }
        _ => Err(format!(
            "there are {} columns; a box has five or six: class, centre x and y, width, height and a score; \
             a polygon seven or more: class, and x and y of each point",
            numbers.len() + 1
        )),
    }
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(|line| line.trim().to_owned()).collect()
}

/// The names of `data.yaml`: a list in one line, or a line for each, with its number or a dash.
fn names_of_yaml(text: &str) -> Vec<String> {
    // A text in double quotes is that of JSON, in which we write names.
    let bare = |name: &str| {
        let name = name.trim();
        serde_json::from_slice(name.as_bytes())
            .unwrap_or_else(|_| name.trim_matches(['"', '\'']).to_owned())
    };
    let mut rest = text.lines().skip_while(|line| !line.starts_with("names:"));
    let first = rest.next().and_then(|line| line.strip_prefix("names:")).unwrap_or_default().trim();
    if let Some(list) = first.strip_prefix('[') {
        if let Ok(names) = serde_json::from_slice(first.as_bytes()) {
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
