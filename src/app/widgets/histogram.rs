//! How often each density occurs.

use egui::{Align2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::number::Digits;
use super::text_at;
use crate::app::theme::{Theme, Type, size};

/// A histogram with logarithmic counts.
#[derive(Clone, Copy, Debug)]
pub struct Histogram<'a> {
    /// The count of each bar, of equal width over `range`; 76 fill a panel of the usual width with 3-point bars.
    pub counts: &'a [u64],
    /// The values at both ends.
    pub range: [f64; 2],
    /// The mean of the values: a line with its number beside it.
    pub mean: Option<f64>,
    /// What is counted, such as "density".
    pub quantity: &'a str,
}

/// The whole height, and where the bars begin and end in it.
const HEIGHT: f32 = 68.0;
const TOP: f32 = 4.0;
const BOTTOM: f32 = 50.0;
/// Centre of the axis text.
const AXIS_TEXT: f32 = 60.0;
/// Height kept free above the bars for the mean's number.
const HEAD: f32 = 12.0;
/// Between bars.
const GAP: f32 = 1.0;
/// A bar with any count is at least this high, so that single voxels are seen.
const SMALLEST: f32 = 1.0;
/// Thickness of the mean's line.
const MEAN: f32 = 1.5;
/// From that line to its number.
const MEAN_GAP: f32 = 5.0;
/// The numbers of the axis.
const DIGITS: Digits = Digits::Significant(2);

impl Histogram<'_> {
    /// Shows it across the panel.
    pub fn show(&self, ui: &mut Ui) {
        let theme = Theme::of(ui);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
        let [low, high] = self.range;
        response.widget_info(|| {
            let mean = self.mean.map_or(String::new(), |mean| format!(", mean {}", DIGITS.format(mean)));
            let text =
                format!("Histogram of {} from {} to {}{mean}", self.quantity, DIGITS.format(low), DIGITS.format(high));
            WidgetInfo::labeled(Role::Image, true, text)
        });
        if !ui.is_rect_visible(rect) {
            return;
        }
        let plot = Rect::from_min_max(
            pos2(rect.left() + size::PADDING, rect.top() + TOP),
            pos2(rect.right() - size::PADDING, rect.top() + BOTTOM),
        );
        let painter = ui.painter();
        let most = self.counts.iter().copied().max().unwrap_or(0);
        let highest = plot.height() - if self.mean.is_some() { HEAD } else { 0.0 };
        let pitch = (plot.width() + GAP) / self.counts.len().max(1) as f32;
        for (i, &count) in self.counts.iter().enumerate() {
            if count == 0 {
                continue;
            }
            let left = plot.left() + pitch * i as f32;
            let height = (log_height(count, most) * highest).max(SMALLEST);
            let bar = Rect::from_min_max(pos2(left, plot.bottom() - height), pos2(left + pitch - GAP, plot.bottom()));
            painter.rect_filled(bar, 0, theme.edge);
        }
        let axis = Rect::from_min_max(plot.left_bottom(), pos2(plot.right(), plot.bottom() + GAP));
        painter.rect_filled(axis, 0, theme.edge);
        let y = rect.top() + AXIS_TEXT;
        let axis_text = |x, anchor, text: &str| {
            text_at(ui, pos2(x, y), anchor, text, Type::Caption, theme.text3);
        };
        let end = |value: f64| if value == 0.0 { "0".into() } else { DIGITS.format(value) };
        axis_text(plot.left(), Align2::LEFT_CENTER, &end(low));
        let what = format!("{}, log count", self.quantity);
        axis_text(plot.center().x, Align2::CENTER_CENTER, &what);
        axis_text(plot.right(), Align2::RIGHT_CENTER, &end(high));
        if let Some(mean) = self.mean.filter(|mean| mean.is_finite() && high > low) {
            let t = ((mean - low) / (high - low)).clamp(0.0, 1.0) as f32;
            let x = plot.left() + t * plot.width();
            painter.vline(x, plot.y_range(), Stroke::new(MEAN, theme.accent));
            let text = format!("mean {}", DIGITS.format(mean));
            let (at, anchor) =
                if t < 0.7 { (x + MEAN_GAP, Align2::LEFT_CENTER) } else { (x - MEAN_GAP, Align2::RIGHT_CENTER) };
            text_at(ui, pos2(at, plot.top() + HEAD / 2.0 - 1.0), anchor, text, Type::Caption, theme.text);
        }
    }
}

/// The height of a bar of `count` where the highest holds `most`, 0 … 1.
fn log_height(count: u64, most: u64) -> f32 {
    if most == 0 { 0.0 } else { ((count as f32).ln_1p() / (most as f32).ln_1p()).min(1.0) }
}

#[cfg(test)]
mod tests {
    use super::log_height;

    #[test]
    fn heights_are_logarithmic() {
        assert_eq!(log_height(0, 0), 0.0);
        assert_eq!(log_height(999, 999), 1.0);
        assert!((log_height(9, 999) - 1.0 / 3.0).abs() < 1e-6);
    }
}
