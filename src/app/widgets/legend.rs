//! What the colours of an overlay mean: a bar with the numbers at its ends and its middle, or the names of its values.

use egui::{Align2, Color32, Mesh, Rect, Role, Sense, Shape, StrokeKind, Ui, WidgetInfo, pos2, vec2};

use super::{Digits, card, text_at, text_width};
use crate::app::theme::{Theme, Type, size};

/// A legend.
#[derive(Clone, Copy)]
pub struct Legend<'a> {
    /// The quantity.
    pub name: &'a str,
    /// Its unit; "" for a pure number.
    pub unit: &'a str,
    /// Values of the first colour, of half the pixels, and of the last colour; `None` while nothing is known.
    pub range: Option<[f64; 3]>,
    /// Where the median lies on the bar, 0 to 1.
    pub median_at: f32,
    /// Words while nothing is known.
    pub waits: &'a str,
    /// Colours follow the logarithm.
    pub log: bool,
    /// Names of the values and their sRGB colours, in place of the bar; empty where values have none.
    pub names: &'a [(&'a str, [u8; 3])],
    /// The colour at a share of the bar.
    pub colour: &'a dyn Fn(f32) -> [f32; 3],
}

/// Width of the bar, its height, and how many pieces it has.
const WIDTH: f32 = 220.0;
const BAR: f32 = 10.0;
const PIECES: usize = 64;
/// Height of a line of text, and of the mark of the median.
const LINE: f32 = 18.0;
const MARK: f32 = 4.0;
/// Side of the patch of a name's colour, and names in a row.
const PATCH: f32 = 10.0;
const COLUMNS: usize = 2;

impl Legend<'_> {
    /// Shows it in the upper left corner of `place`.
    pub fn show(&self, ui: &mut Ui, place: Rect) {
        let at = place.left_top() + vec2(size::PADDING, size::PADDING);
        let area = egui::Area::new(egui::Id::unique("legend")).order(egui::Order::Middle).fixed_pos(at);
        area.interactable(false).show(ui.ctx(), |ui| {
            card(Theme::of(ui)).show(ui, |ui| if self.names.is_empty() { self.bar(ui) } else { self.patches(ui) })
        });
    }

    fn patches(&self, ui: &mut Ui) {
        let theme = Theme::of(ui);
        let waits = self.range.is_none();
        let rows = 1 + self.names.len().div_ceil(COLUMNS) + usize::from(waits);
        let (rect, response) = ui.allocate_exact_size(vec2(WIDTH, rows as f32 * LINE), Sense::hover());
        let names: Vec<&str> = self.names.iter().map(|(name, _)| *name).collect();
        let all = format!("{}: {}", self.name, if waits { self.waits.to_owned() } else { names.join(", ") });
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &all));
        if waits {
            let at = pos2(rect.left(), rect.bottom() - LINE / 2.0);
            text_at(ui, at, Align2::LEFT_CENTER, self.waits, Type::Small, theme.text2);
        }
        let title = pos2(rect.left(), rect.top() + LINE / 2.0);
        text_at(ui, title, Align2::LEFT_CENTER, self.name, Type::SmallValue, theme.text);
        for (i, (name, [r, g, b])) in self.names.iter().enumerate() {
            let cell = vec2((i % COLUMNS) as f32 * WIDTH / COLUMNS as f32, (1 + i / COLUMNS) as f32 * LINE);
            let middle = rect.min + cell + vec2(PATCH, LINE) / 2.0;
            let patch = Rect::from_center_size(middle, vec2(PATCH, PATCH));
            ui.painter().rect(patch, 0, Color32::from_rgb(*r, *g, *b), (1.0, theme.edge), StrokeKind::Inside);
            let at = pos2(patch.right() + size::SPACE, middle.y);
            text_at(ui, at, Align2::LEFT_CENTER, name, Type::Small, theme.text2);
        }
    }

    fn bar(&self, ui: &mut Ui) {
        let theme = Theme::of(ui);
        let (rect, response) = ui.allocate_exact_size(vec2(WIDTH, 2.0 * LINE + BAR + MARK), Sense::hover());
        let scale = if self.log { "log" } else { "" };
        let title = pos2(rect.left(), rect.top() + LINE / 2.0);
        let name = text_at(ui, title, Align2::LEFT_CENTER, self.name, Type::SmallValue, theme.text);
        let unit = pos2(name.right() + size::SPACE, title.y);
        text_at(ui, unit, Align2::LEFT_CENTER, self.unit, Type::Small, theme.text3);
        text_at(ui, pos2(rect.right(), title.y), Align2::RIGHT_CENTER, scale, Type::Small, theme.text3);
        let bar = Rect::from_min_size(pos2(rect.left(), rect.top() + LINE), vec2(WIDTH, BAR));
        let mut mesh = Mesh::default();
        for i in 0..=PIECES {
            let share = i as f32 / PIECES as f32;
            let [r, g, b] = (self.colour)(share).map(|x| (x * 255.0).round() as u8);
            let x = bar.left() + share * bar.width();
            mesh.colored_vertex(pos2(x, bar.top()), Color32::from_rgb(r, g, b));
            mesh.colored_vertex(pos2(x, bar.bottom()), Color32::from_rgb(r, g, b));
            if i > 0 {
                let n = 2 * i as u32;
                mesh.add_triangle(n - 2, n - 1, n);
                mesh.add_triangle(n - 1, n, n + 1);
            }
        }
        ui.painter().add(Shape::mesh(mesh));
        let y = rect.bottom() - LINE / 2.0;
        let Some([low, median, high]) = self.range.map(|r| r.map(figure)) else {
            let words = format!("{}: {}", self.name, self.waits);
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
            text_at(ui, pos2(rect.left(), y), Align2::LEFT_CENTER, self.waits, Type::Small, theme.text2);
            return;
        };
        let middle = format!("median {median}");
        response.widget_info(|| {
            let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
            WidgetInfo::labeled(Role::Label, true, format!("{}: {low} to {high}{unit}, {middle}", self.name))
        });
        let mark = bar.left() + self.median_at.clamp(0.0, 1.0) * bar.width();
        ui.painter().vline(mark, bar.bottom()..=bar.bottom() + MARK, egui::Stroke::new(1.5, theme.text));
        let first = text_at(ui, pos2(rect.left(), y), Align2::LEFT_CENTER, low, Type::Small, theme.text2);
        let last = text_at(ui, pos2(rect.right(), y), Align2::RIGHT_CENTER, high, Type::Small, theme.text2);
        // Below its mark where there is room between the ends.
        let half = text_width(ui, &middle, Type::Small) / 2.0 + size::SPACE / 2.0;
        let x = mark.clamp(first.right() + half, (last.left() - half).max(first.right() + half));
        text_at(ui, pos2(x, y), Align2::CENTER_CENTER, middle, Type::Small, theme.text);
    }
}

fn figure(x: f64) -> String {
    if x == 0.0 { "0".into() } else { Digits::Significant(3).format(x) }
}
