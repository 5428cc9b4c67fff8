//! Tables: as CSV for programs, as Markdown for people.

/// Rows under named columns.
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new<S: Into<String>>(columns: impl IntoIterator<Item = S>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: impl IntoIterator<Item = String>) {
        self.rows.push(row.into_iter().collect());
    }

    /// As CSV. No cell holds a comma or a quote.
    pub fn csv(&self) -> String {
        std::iter::once(&self.columns).chain(&self.rows).map(|row| row.join(",") + "\n").collect()
    }

    /// As Markdown, all columns but the first aligned to the right.
    pub fn markdown(&self) -> String {
        let line = |row: &[String]| format!("| {} |\n", row.join(" | "));
        let rule: Vec<String> =
            (0..self.columns.len()).map(|c| (if c == 0 { "---" } else { "---:" }).into()).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        line(&self.columns) + &line(&rule) + &rows
    }
}

/// A number with about three significant digits, for people: `12,345`, `12.3`, `0.0123`.
pub fn short(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 4) };
    grouped(&format!("{x:.0$}", digits as usize))
}

/// A number at an axis: `10,000`, `0.1`.
pub fn tick(x: f64) -> String {
    let text = format!("{x:.4}");
    grouped(text.trim_end_matches('0').trim_end_matches('.'))
}

/// A whole number, for people.
pub fn count(n: usize) -> String {
    grouped(&n.to_string())
}

/// A percentage with its sign.
pub fn percent(x: f64) -> String {
    let digits = if x.abs() < 10.0 { 1 } else { 0 };
    grouped(&format!("{x:+.digits$}")) + " %"
}

/// Commas between groups of three digits.
fn grouped(number: &str) -> String {
    let (whole, rest) = number.split_at(number.find('.').unwrap_or(number.len()));
    let (sign, digits) = whole.split_at(whole.find(|c: char| c.is_ascii_digit()).unwrap_or(0));
    let mut text = String::from(sign);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(
            [0.01234, 1.5, 12.34, 123.4, 1_234_567.8].map(short),
            ["0.0123", "1.50", "12.3", "123", "1,234,568"]
        );
        assert_eq!([10_000.0, 0.01, -20.0].map(tick), ["10,000", "0.01", "-20"]);
        assert_eq!(count(41_488), "41,488");
        assert_eq!([-3.44, 1196.74].map(percent), ["-3.4 %", "+1,197 %"]);
    }
}
