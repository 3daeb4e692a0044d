//! The modules, programs, presets, scenes and views that ship, inside the binary.

/// Path below the library's folder, for instance `wgsl/hash/pcg.wgsl`, and text of each file, in the order of the paths.
pub const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/shipped.rs"));

/// What stands before a path in messages: no folder has this name.
const FOLDER: &str = "<veduta>/";

/// The name of a file in messages.
pub fn name(path: &str) -> String {
    format!("{FOLDER}{path}")
}

/// The text of a file by its name in messages.
pub fn text(name: &str) -> Option<&'static str> {
    let path = name.strip_prefix(FOLDER)?;
    let index = FILES.binary_search_by_key(&path, |(file, _)| file).ok()?;
    FILES.get(index).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_found_by_its_name() {
        assert!(FILES.len() > 40, "{}", FILES.len());
        for (path, content) in FILES {
            assert_eq!(text(&name(path)), Some(*content), "{path}");
        }
        assert_eq!(text("wgsl/hash/pcg.wgsl"), None);
    }
}
