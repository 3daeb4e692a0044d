//! Located errors, the `.sp` reader, keys, presets, scenes, views and module headers.

mod diag;
mod header;
mod settings;
mod sp;

/// The fenced blocks of a kind in a document.
fn blocks<'a>(document: &'a str, kind: &str) -> Vec<&'a str> {
    let fence = format!("```{kind}\n");
    document
        .match_indices(&fence)
        .map(|(at, _)| {
            let block = &document[at + fence.len()..];
            &block[..block.find("```").unwrap()]
        })
        .collect()
}
