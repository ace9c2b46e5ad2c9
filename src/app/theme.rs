//! How the window looks: colours of both themes, type, measures, icons, and the egui style made from them.
//!
//! This is the only place with colour values. Widgets ask [`Theme::of`] for the tokens of the theme in use. Every grey
//! is neutral (R = G = B), since a tinted surround shifts how the colours of the picture are judged.

use std::sync::{Arc, LazyLock};

use egui::style::{HandleShape, ScrollStyle, Selection, TextCursorStyle, WidgetVisuals};
use egui::{
    Color32, Context, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Shadow, Stroke, Style, Ui,
    vec2,
};

/// The colours of one theme.
#[derive(Debug)]
pub struct Theme {
    /// Behind and beside the picture.
    pub canvas: Color32,
    /// Top bar, timeline, status line.
    pub bar: Color32,
    /// Side panel, cards, popups.
    pub panel: Color32,
    /// Slider, combo, text edit.
    pub field: Color32,
    /// A field under the pointer; the scroll bar.
    pub hover: Color32,
    /// The ground of segmented controls and of tracks on bars.
    pub well: Color32,
    /// A selected segment, a tool that is on.
    pub active: Color32,
    /// The filled part of a slider.
    pub fill: Color32,
    /// Slider underline at its default, checkbox outline, axes, histogram bars.
    pub edge: Color32,
    /// Hairlines, grid lines of plots, card outlines.
    pub line: Color32,
    /// Values, titles.
    pub text: Color32,
    /// Labels, icons at rest, units inside fields.
    pub text2: Color32,
    /// Captions, units of read-outs, summaries; only on `panel` and `bar` (elsewhere its contrast is too low).
    pub text3: Color32,
    /// Changed, focus, action text, progress, series A.
    pub accent: Color32,
    /// Series B.
    pub series_b: Color32,
    /// Biased, software adapter, caution.
    pub warn: Color32,
    /// The ground of a biased field and of the banner.
    pub warn_bg: Color32,
    /// Failure.
    pub err: Color32,
    /// Proven good: unbiased, saved.
    pub ok: Color32,
    /// Over everything, under an overlay.
    pub scrim: Color32,
    /// The shadow of cards.
    pub shadow: Color32,
    /// Text selection and its like: `accent`, mostly transparent.
    pub selection: Color32,
}

const fn grey(v: u8) -> Color32 {
    Color32::from_gray(v)
}

const fn rgb(hex: u32) -> Color32 {
    Color32::from_rgb((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// The dark theme, the default.
pub const DARK: Theme = Theme {
    canvas: grey(0x14),
    bar: grey(0x1A),
    panel: grey(0x20),
    field: grey(0x2C),
    hover: grey(0x37),
    well: grey(0x2C),
    active: grey(0x46),
    fill: grey(0x41),
    edge: grey(0x8C),
    line: grey(0x2E),
    text: grey(0xE8),
    text2: grey(0xB0),
    text3: grey(0x8F),
    accent: rgb(0x6AA9F7),
    series_b: rgb(0xE89A5B),
    warn: rgb(0xE8B04B),
    warn_bg: rgb(0x3A2F1A),
    err: rgb(0xF47B70),
    ok: rgb(0x74C487),
    scrim: Color32::from_black_alpha(150),
    shadow: Color32::from_black_alpha(120),
    selection: Color32::from_rgba_unmultiplied_const(0x6A, 0xA9, 0xF7, 89),
};

/// The light theme. Its canvas is a mid grey: never white next to a picture.
pub const LIGHT: Theme = Theme {
    canvas: grey(0x9A),
    bar: grey(0xE2),
    panel: grey(0xEE),
    field: grey(0xDC),
    hover: grey(0xD0),
    well: grey(0xD0),
    active: grey(0xFF),
    fill: grey(0xC2),
    edge: grey(0x6A),
    line: grey(0xD6),
    text: grey(0x1B),
    text2: grey(0x4A),
    text3: grey(0x62),
    accent: rgb(0x1C62C4),
    series_b: rgb(0xA8500F),
    warn: rgb(0x8A5300),
    warn_bg: rgb(0xF6E6C8),
    err: rgb(0xB42318),
    ok: rgb(0x1D6F38),
    scrim: Color32::from_black_alpha(110),
    shadow: Color32::from_black_alpha(60),
    selection: Color32::from_rgba_unmultiplied_const(0x1C, 0x62, 0xC4, 64),
};

/// The world's axes X, Y, Z on the picture, muted; the same in both themes, since the picture is.
pub const AXES: [Color32; 3] = [rgb(0xC4706A), rgb(0x86A878), rgb(0x6E93C8)];
/// A pixel that is not finite: a colour that no picture and no overlay has.
pub const FLAG: Color32 = rgb(0xFF00FF);
/// The letters on them.
pub const AXIS_TEXT: Color32 = grey(0x14);

impl Theme {
    /// The theme that `ui` is drawn in.
    pub fn of(ui: &Ui) -> &'static Theme {
        if ui.visuals().dark_mode { &DARK } else { &LIGHT }
    }

    /// The theme that the window is drawn in.
    pub fn current(ctx: &Context) -> &'static Theme {
        match ctx.theme() {
            egui::Theme::Dark => &DARK,
            egui::Theme::Light => &LIGHT,
        }
    }

    /// The shadow of cards; nothing else has one.
    pub fn card_shadow(&self) -> Shadow {
        Shadow { offset: [0, 4], blur: 16, spread: 0, color: self.shadow }
    }
}

/// Measures in points. The grid is 4.
pub mod size {
    /// Gap between rows.
    pub const GAP: f32 = 4.0;
    /// Gap between things that belong together.
    pub const SPACE: f32 = 8.0;
    /// Padding of the panel left and right, and the distance of cards from the viewport's edges.
    pub const PADDING: f32 = 16.0;
    /// Centre of the gutter that holds the "changed" and "biased" dots, from the panel's left.
    pub const GUTTER: f32 = 7.0;
    /// Radius of such a dot.
    pub const DOT: f32 = 2.5;
    /// Height of a row.
    pub const ROW: f32 = 24.0;
    /// Height of the field in a row.
    pub const FIELD: f32 = 22.0;
    /// Where fields begin, from the panel's left.
    pub const FIELD_LEFT: f32 = 120.0;
    /// Where labels end, from the panel's left.
    pub const LABEL_RIGHT: f32 = 112.0;
    /// Where numbers end, from the field's right: units come after it.
    pub const NUMBER_INSET: f32 = 46.0;
    /// From the end of a number to its unit.
    pub const UNIT_GAP: f32 = 5.0;
    /// Height of a section header.
    pub const HEADER: f32 = 30.0;
    /// Extra space under an open section.
    pub const SECTION_END: f32 = 6.0;
    /// Height of a row of read-outs.
    pub const READOUT: f32 = 42.0;
    /// Height of the top bar.
    pub const TOP_BAR: f32 = 40.0;
    /// Side of a tool button.
    pub const TOOL: f32 = 28.0;
    /// Distance between the left edges of neighbouring tools.
    pub const TOOL_PITCH: f32 = 34.0;
    /// Height of the timeline.
    pub const TIMELINE: f32 = 36.0;
    /// Height of the status line.
    pub const STATUS: f32 = 26.0;
    /// Height of the banner.
    pub const BANNER: f32 = 34.0;
    /// Width of the side panel at first start.
    pub const PANEL: f32 = 336.0;
    /// The widths that the side panel can be dragged to.
    pub const PANEL_RANGE: std::ops::RangeInclusive<f32> = 300.0..=480.0;
    /// Below this window width the panel lies over the viewport instead of beside it.
    pub const DOCKED_FROM: f32 = 900.0;
    /// Below this window width the mode, undo and compare move into the panel.
    pub const COMPACT_BELOW: f32 = 560.0;
    /// Width of a toast.
    pub const TOAST: f32 = 356.0;
    /// Width of a tooltip card.
    pub const TIP: f32 = 300.0;
    /// Corner radius of fields.
    pub const RADIUS: u8 = 4;
    /// Corner radius of a segment inside its control.
    pub const RADIUS_INNER: u8 = 3;
    /// Corner radius of menus, and of the focus ring.
    pub const RADIUS_MENU: u8 = 6;
    /// Corner radius of cards.
    pub const RADIUS_CARD: u8 = 8;
    /// Side of an icon.
    pub const ICON: f32 = 16.0;
    /// Distance of the focus ring from its field, and its thickness.
    pub const FOCUS: f32 = 2.0;
}

/// The sizes and weights of type. Nothing is smaller than [`Type::Caption`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// 11: captions of read-outs, axis text.
    Caption,
    /// 11 medium: key caps.
    Key,
    /// 12: units, summaries, status line, body of toasts and tooltips.
    Small,
    /// 12 medium: values in the status line, segments, actions.
    SmallValue,
    /// 13: labels, combos.
    Body,
    /// 13 medium: values.
    Value,
    /// 13 semibold: titles of sections, cards and toasts.
    Header,
    /// 16 medium: the number of a read-out.
    Readout,
    /// 18 semibold: the title of an overlay.
    Title,
    /// 16: icons.
    Icon,
    /// 14: the smaller icons of rows and the status line.
    SmallIcon,
}

static MEDIUM: LazyLock<FontFamily> = LazyLock::new(|| FontFamily::Name("medium".into()));
static SEMIBOLD: LazyLock<FontFamily> = LazyLock::new(|| FontFamily::Name("semibold".into()));
static ICONS: LazyLock<FontFamily> = LazyLock::new(|| FontFamily::Name("icons".into()));

impl Type {
    /// The font of this type.
    pub fn font(self) -> FontId {
        let regular = FontFamily::Proportional;
        match self {
            Type::Caption => FontId::new(11.0, regular),
            Type::Key => FontId::new(11.0, MEDIUM.clone()),
            Type::Small => FontId::new(12.0, regular),
            Type::SmallValue => FontId::new(12.0, MEDIUM.clone()),
            Type::Body => FontId::new(13.0, regular),
            Type::Value => FontId::new(13.0, MEDIUM.clone()),
            Type::Header => FontId::new(13.0, SEMIBOLD.clone()),
            Type::Readout => FontId::new(16.0, MEDIUM.clone()),
            Type::Title => FontId::new(18.0, SEMIBOLD.clone()),
            Type::Icon => FontId::new(16.0, ICONS.clone()),
            Type::SmallIcon => FontId::new(14.0, ICONS.clone()),
        }
    }
}

/// A sign of the icon font with the name that screen readers and tooltips give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Icon {
    /// The sign, in the family of [`Type::Icon`].
    pub glyph: char,
    /// What it does, as a command.
    pub name: &'static str,
}

/// The icons of the window. They are used only where the sign is widely known.
pub mod icon {
    use super::Icon;

    const fn icon(glyph: char, name: &'static str) -> Icon {
        Icon { glyph, name }
    }

    /// Open a file.
    pub const OPEN: Icon = icon('\u{E247}', "Open");
    /// Save the scene.
    pub const SAVE: Icon = icon('\u{E14D}', "Save");
    /// Undo.
    pub const UNDO: Icon = icon('\u{E2A1}', "Undo");
    /// Redo.
    pub const REDO: Icon = icon('\u{E2A0}', "Redo");
    /// A/B wipe.
    pub const COMPARE: Icon = icon('\u{E3B6}', "Compare");
    /// Save a picture.
    pub const CAPTURE: Icon = icon('\u{E064}', "Save picture");
    /// Keys and mouse.
    pub const HELP: Icon = icon('\u{E082}', "Help");
    /// Show or hide the side panel.
    pub const PANEL: Icon = icon('\u{E431}', "Side panel");
    /// Play a sequence.
    pub const PLAY: Icon = icon('\u{E13C}', "Play");
    /// Pause.
    pub const PAUSE: Icon = icon('\u{E12E}', "Pause");
    /// One frame back.
    pub const STEP_BACK: Icon = icon('\u{E15F}', "Step back");
    /// One frame on.
    pub const STEP_ON: Icon = icon('\u{E160}', "Step on");
    /// Play round and round.
    pub const LOOP: Icon = icon('\u{E146}', "Loop");
    /// Close.
    pub const CLOSE: Icon = icon('\u{E1B2}', "Close");
    /// Good, done.
    pub const OK: Icon = icon('\u{E06C}', "Done");
    /// Information.
    pub const INFO: Icon = icon('\u{E0F9}', "Information");
    /// Caution.
    pub const WARN: Icon = icon('\u{E193}', "Caution");
    /// Failure.
    pub const FAIL: Icon = icon('\u{E084}', "Error");
    /// Search.
    pub const SEARCH: Icon = icon('\u{E151}', "Search");
    /// Something folds out below.
    pub const DOWN: Icon = icon('\u{E06D}', "Open");
    /// Something is folded away.
    pub const RIGHT: Icon = icon('\u{E06F}', "Closed");
    /// Channels move together.
    pub const LOCK: Icon = icon('\u{E10B}', "One value for all channels");
    /// Channels move on their own.
    pub const LINK: Icon = icon('\u{E103}', "Separate channels");
    /// Back to the default.
    pub const RESET: Icon = icon('\u{E148}', "Reset");
    /// A new seed.
    pub const DICES: Icon = icon('\u{E2C5}', "Another seed");
    /// Pixel inspector.
    pub const INSPECT: Icon = icon('\u{E0AC}', "Pixel inspector");
    /// Settings, all commands.
    pub const COMMANDS: Icon = icon('\u{E29A}', "All commands");
    /// More.
    pub const MORE: Icon = icon('\u{E0B6}', "More");
}

const INTER: &[u8] = include_bytes!("../../assets/fonts/inter.ttf");
const ICON_FONT: &[u8] = include_bytes!("../../assets/fonts/icons.ttf");

/// Sets the fonts and both styles. Call it once, before the first frame: egui is built without fonts of its own.
pub fn install(ctx: &Context) {
    ctx.set_fonts(fonts());
    ctx.style_mut_of(egui::Theme::Dark, |style| apply(style, &DARK));
    ctx.style_mut_of(egui::Theme::Light, |style| apply(style, &LIGHT));
}

/// Turns the short animations of hover and fold off, as the system can ask for.
pub fn reduce_motion(ctx: &Context, reduce: bool) {
    ctx.all_styles_mut(|style| style.animation_time = if reduce { 0.0 } else { ANIMATION });
}

/// Inter in three weights cut from one variable file, and the icons behind each, so that every family draws both.
fn fonts() -> FontDefinitions {
    const ICON_DATA: &str = "icons";
    let mut fonts = FontDefinitions::empty();
    let families = [
        ("regular", 400.0, vec![FontFamily::Proportional, FontFamily::Monospace]),
        ("medium", 500.0, vec![MEDIUM.clone()]),
        ("semibold", 600.0, vec![SEMIBOLD.clone()]),
    ];
    for (name, weight, uses) in families {
        let mut data = FontData::from_static(INTER);
        data.tweak.coords.push(b"wght", weight);
        data.tweak.thin_space_width = THIN_SPACE;
        fonts.font_data.insert(name.into(), Arc::new(data));
        for family in uses {
            fonts.families.insert(family, vec![name.into(), ICON_DATA.into()]);
        }
    }
    fonts.font_data.insert(ICON_DATA.into(), Arc::new(FontData::from_static(ICON_FONT)));
    fonts.families.insert(ICONS.clone(), vec![ICON_DATA.into(), "regular".into()]);
    fonts
}

/// Width of the thin space between thousands, in normal spaces.
const THIN_SPACE: f32 = 1.0;
/// Seconds of the change of colour on hover and of folding.
const ANIMATION: f32 = 0.1;
/// Seconds that the pointer rests before a tooltip comes.
const TIP_DELAY: f32 = 0.5;

/// The stock egui style in `theme`'s colours.
fn apply(style: &mut Style, theme: &Theme) {
    use egui::TextStyle;
    style.text_styles = [
        (TextStyle::Small, Type::Caption.font()),
        (TextStyle::Body, Type::Body.font()),
        (TextStyle::Button, Type::Value.font()),
        (TextStyle::Heading, Type::Title.font()),
        (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
    ]
    .into();
    style.animation_time = ANIMATION;
    style.interaction.tooltip_delay = TIP_DELAY;
    style.interaction.selectable_labels = false;

    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(8.0, 4.0);
    spacing.button_padding = vec2(8.0, 3.0);
    spacing.interact_size = vec2(size::ROW, size::ROW);
    spacing.icon_width = size::ICON;
    spacing.icon_spacing = 8.0;
    spacing.window_margin = Margin::same(16);
    spacing.menu_margin = Margin::same(4);
    spacing.menu_spacing = 4.0;
    spacing.tooltip_width = size::TIP;
    spacing.slider_rail_height = 4.0;
    spacing.scroll = ScrollStyle { floating_width: 3.0, ..ScrollStyle::floating() };
    spacing.scroll.foreground_color = false;
    spacing.scroll.dormant_handle_opacity = 1.0;
    // The panel paints its own fade, in the panel's colour.
    spacing.scroll.fade.strength = 0.0;

    let visuals = &mut style.visuals;
    visuals.panel_fill = theme.panel;
    visuals.window_fill = theme.panel;
    visuals.extreme_bg_color = theme.field;
    visuals.text_edit_bg_color = Some(theme.field);
    visuals.code_bg_color = theme.field;
    visuals.faint_bg_color = theme.bar;
    visuals.weak_text_color = Some(theme.text3);
    visuals.hyperlink_color = theme.accent;
    visuals.warn_fg_color = theme.warn;
    visuals.error_fg_color = theme.err;
    visuals.window_corner_radius = CornerRadius::same(size::RADIUS_CARD);
    visuals.menu_corner_radius = CornerRadius::same(size::RADIUS_MENU);
    visuals.window_stroke = Stroke::new(1.0, theme.line);
    visuals.window_shadow = theme.card_shadow();
    visuals.popup_shadow = theme.card_shadow();
    visuals.selection = Selection { bg_fill: theme.selection, stroke: Stroke::new(2.0, theme.accent) };
    visuals.text_cursor =
        TextCursorStyle { stroke: Stroke::new(1.5, theme.text), blink: false, ..TextCursorStyle::default() };
    visuals.indent_has_left_vline = false;
    visuals.striped = false;
    visuals.collapsing_header_frame = false;
    visuals.handle_shape = HandleShape::Rect { aspect_ratio: 0.4 };
    visuals.slider_trailing_fill = true;
    visuals.disabled_alpha = 0.45;

    let look = |fill, outline, ink| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: outline,
        corner_radius: CornerRadius::same(size::RADIUS),
        fg_stroke: Stroke::new(1.0, ink),
        expansion: 0.0,
    };
    visuals.widgets.noninteractive = look(theme.panel, Stroke::new(1.0, theme.line), theme.text2);
    visuals.widgets.inactive = look(theme.field, Stroke::NONE, theme.text);
    visuals.widgets.hovered = look(theme.hover, Stroke::NONE, theme.text);
    // A focused widget has this look too, hence the outline.
    visuals.widgets.active = look(theme.active, Stroke::new(1.0, theme.accent), theme.text);
    visuals.widgets.open = look(theme.hover, Stroke::NONE, theme.text);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance and contrast as in WCAG 2.2.
    fn contrast(a: Color32, b: Color32) -> f32 {
        let light = |c: Color32| {
            let linear = |v: u8| egui::ecolor::linear_f32_from_gamma_u8(v);
            0.2126 * linear(c.r()) + 0.7152 * linear(c.g()) + 0.0722 * linear(c.b())
        };
        let (a, b) = (light(a), light(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn text_and_graphics_have_the_contrast_of_wcag() {
        for theme in [&DARK, &LIGHT] {
            let grounds = [theme.panel, theme.bar];
            for ground in grounds {
                for ink in [theme.text, theme.text2, theme.text3] {
                    assert!(contrast(ink, ground) >= 4.5, "{ink:?} on {ground:?} {}", contrast(ink, ground));
                }
            }
            for ground in [theme.field, theme.fill, theme.warn_bg] {
                assert!(contrast(theme.text, ground) >= 4.5);
                assert!(contrast(theme.text2, ground) >= 4.5);
                assert!(contrast(theme.edge, ground) >= 2.95);
                assert!(contrast(theme.accent, ground) >= 3.0);
            }
            for ink in [theme.accent, theme.warn, theme.err, theme.ok] {
                assert!(contrast(ink, theme.panel) >= 4.5, "{ink:?} {}", contrast(ink, theme.panel));
            }
            assert!(contrast(theme.warn, theme.warn_bg) >= 4.5);
        }
    }

    #[test]
    fn greys_have_no_tint() {
        for theme in [&DARK, &LIGHT] {
            let greys = [
                theme.canvas,
                theme.bar,
                theme.panel,
                theme.field,
                theme.hover,
                theme.well,
                theme.active,
                theme.fill,
                theme.edge,
                theme.line,
                theme.text,
                theme.text2,
                theme.text3,
            ];
            for c in greys {
                assert!(c.r() == c.g() && c.g() == c.b(), "{c:?}");
            }
        }
    }

    #[test]
    fn both_styles_are_set() {
        let ctx = Context::default();
        install(&ctx);
        assert_eq!(ctx.style_of(egui::Theme::Dark).visuals.panel_fill, DARK.panel);
        assert_eq!(ctx.style_of(egui::Theme::Light).visuals.panel_fill, LIGHT.panel);
        reduce_motion(&ctx, true);
        assert_eq!(ctx.style_of(egui::Theme::Light).animation_time, 0.0);
    }
}
