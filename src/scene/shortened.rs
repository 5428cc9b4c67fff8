//! What messages quote: files of noise have no end of it.

use std::borrow::Cow;

/// A text for a message, without its end if it is long.
pub fn abridged(text: &str) -> Cow<'_, str> {
    const LONGEST: usize = 400;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

/// A word for a message, without its end if it is long.
pub fn shortened(word: &str) -> String {
    const LONGEST: usize = 40;
    if word.chars().count() <= LONGEST {
        return word.into();
    }
    word.chars().take(LONGEST).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_an_end_in_messages() {
        assert_eq!((shortened("é"), &*abridged("é")), ("é".to_owned(), "é"));
        let noise = "é".repeat(1 << 20);
        assert!(shortened(&noise).len() < 100 && abridged(&noise).len() < 1000);
    }
}
