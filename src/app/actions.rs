//! Every action of the window, declared once: its name, keys and words. Shortcuts, the help overlay and tests follow.

use egui::{Key, Modifiers};

/// Something that a key or a button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// Ask for a file.
    Open,
    /// Save the scene as TOML.
    SaveScene,
    /// Save PNG and EXR.
    Capture,
    /// Take back the last change.
    Undo,
    /// Do it again.
    Redo,
    /// Take back the last move of the camera.
    CameraBack,
    /// Read the volume again.
    Reload,
    /// Show or hide the side panel.
    Panel,
    /// Show or hide the keys.
    Help,
    /// Full screen.
    FullScreen,
    /// Fit the volume.
    Frame,
    /// The camera of the scene.
    ResetCamera,
    /// Look from the front.
    Front,
    /// Look from the right.
    Right,
    /// Look from above.
    Top,
    /// Look from behind.
    Back,
    /// Look from the left.
    Left,
    /// Look from below.
    Bottom,
    /// The camera of this bookmark, from 0.
    GoTo(u8),
    /// Keep the camera as this bookmark, from 0.
    Store(u8),
    /// Brighter.
    ExposureUp,
    /// Darker.
    ExposureDown,
    /// Next tone map.
    NextToneMap,
    /// Next overlay.
    NextOverlay,
    /// Show or hide the pixel inspector.
    Inspect,
    /// Show or hide the self-test.
    SelfTest,
    /// Hold or go on.
    Pause,
    /// One more sample while held.
    Step,
    /// Start the picture anew.
    Restart,
    /// Forget the light paths that are kept from frame to frame.
    DropHistory,
    /// Read the shaders again (debug builds run from the source tree).
    ReloadShaders,
    /// Reduced resolution while things move.
    DynamicScale,
    /// Open or close the lab: two sides, A and B.
    Lab,
    /// Next of what the lab can show.
    NextView,
    /// Light or dark window.
    Theme,
    /// End the program.
    Quit,
}

/// A row of the table.
pub struct Row {
    /// What it does.
    pub action: Action,
    /// Heading in the help overlay.
    pub group: &'static str,
    /// What it does, in words.
    pub text: &'static str,
    /// Keys that trigger it; the first is shown.
    pub keys: &'static [(Modifiers, Key)],
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
const ALT_SHIFT: Modifiers = Modifiers::ALT.plus(Modifiers::SHIFT);

/// The table. Neighbours with the same words are one line of the help overlay.
pub const ACTIONS: &[Row] = &[
    row(Action::Open, "File", "Open a file", &[(CTRL, Key::O)]),
    row(Action::SaveScene, "File", "Save the scene", &[(CTRL, Key::S)]),
    row(Action::Capture, "File", "Save the picture", &[(NONE, Key::F12)]),
    row(Action::Reload, "File", "Read the volume again", &[(NONE, Key::F5), (CTRL, Key::R)]),
    row(Action::Quit, "File", "Quit", &[(CTRL, Key::Q)]),
    row(Action::Undo, "Edit", "Undo", &[(CTRL, Key::Z)]),
    row(Action::Redo, "Edit", "Redo", &[(CTRL_SHIFT, Key::Z), (CTRL, Key::Y)]),
    row(Action::CameraBack, "Edit", "Undo a camera move", &[(ALT, Key::Z)]),
    row(Action::Frame, "Camera", "Fit the volume", &[(NONE, Key::F)]),
    row(Action::ResetCamera, "Camera", "Reset the camera", &[(NONE, Key::Home), (NONE, Key::Enter)]),
    row(Action::Front, "Camera", "Look from the front", &[(NONE, Key::Num1)]),
    row(Action::Right, "Camera", "Look from the right", &[(NONE, Key::Num3)]),
    row(Action::Top, "Camera", "Look from above", &[(NONE, Key::Num7)]),
    row(Action::Back, "Camera", "Look from behind", &[(CTRL, Key::Num1)]),
    row(Action::Left, "Camera", "Look from the left", &[(CTRL, Key::Num3)]),
    row(Action::Bottom, "Camera", "Look from below", &[(CTRL, Key::Num7)]),
    row(Action::GoTo(0), "Camera", GO_TO, &[(ALT, Key::Num1)]),
    row(Action::GoTo(1), "Camera", GO_TO, &[(ALT, Key::Num2)]),
    row(Action::GoTo(2), "Camera", GO_TO, &[(ALT, Key::Num3)]),
    row(Action::GoTo(3), "Camera", GO_TO, &[(ALT, Key::Num4)]),
    row(Action::Store(0), "Camera", STORE, &[(ALT_SHIFT, Key::Num1)]),
    row(Action::Store(1), "Camera", STORE, &[(ALT_SHIFT, Key::Num2)]),
    row(Action::Store(2), "Camera", STORE, &[(ALT_SHIFT, Key::Num3)]),
    row(Action::Store(3), "Camera", STORE, &[(ALT_SHIFT, Key::Num4)]),
    row(Action::ExposureUp, "View", "Brighter by half a stop", &[(NONE, Key::CloseBracket)]),
    row(Action::ExposureDown, "View", "Darker by half a stop", &[(NONE, Key::OpenBracket)]),
    row(Action::NextToneMap, "View", "Next tone map", &[(NONE, Key::T)]),
    row(Action::NextOverlay, "View", "Next overlay", &[(NONE, Key::O)]),
    row(Action::Inspect, "View", "Inspect pixels", &[(NONE, Key::I)]),
    row(Action::Panel, "View", "Show or hide the panel", &[(NONE, Key::Tab)]),
    row(Action::FullScreen, "View", "Full screen", &[(NONE, Key::F11)]),
    row(Action::Lab, "View", "Compare A and B", &[(NONE, Key::C)]),
    row(Action::NextView, "View", "Wipe, A, B, difference", &[(SHIFT, Key::C)]),
    row(Action::Theme, "View", "Light or dark window", &[(CTRL, Key::L)]),
    row(Action::Help, "View", "This list", &[(NONE, Key::H), (SHIFT, Key::Slash), (NONE, Key::Questionmark)]),
    row(Action::Pause, "Render", "Hold or go on", &[(SHIFT, Key::Space), (NONE, Key::P)]),
    row(Action::Step, "Render", "One more sample", &[(NONE, Key::Period)]),
    row(Action::Restart, "Render", "Start the picture anew", &[(SHIFT, Key::R)]),
    row(Action::DropHistory, "Render", "Drop the history of reused paths", &[(SHIFT, Key::H)]),
    row(Action::ReloadShaders, "Render", "Read the shaders again", &[(SHIFT, Key::F5)]),
    row(Action::DynamicScale, "Render", "Adapt the resolution", &[(SHIFT, Key::D)]),
    row(Action::SelfTest, "Render", "Test this adapter", &[(CTRL, Key::T)]),
];

const GO_TO: &str = "Go to view 1 … 4";
const STORE: &str = "Keep as view 1 … 4";

const fn row(action: Action, group: &'static str, text: &'static str, keys: &'static [(Modifiers, Key)]) -> Row {
    Row { action, group, text, keys }
}

/// What the mouse does, for the help overlay.
pub const MOUSE: &[(&[&str], &str)] = &[
    (&["Drag"], "Orbit"),
    (&["Right drag"], "Pan (also middle, Shift)"),
    (&["Wheel"], "Dolly to the cursor"),
    (&["Double click"], "Set the pivot"),
    (&["Alt", "Drag"], "Roll"),
    (&["W A S D Q E"], "Fly; Shift faster, Ctrl slower"),
    (&["Shift", "Right drag"], "Turn the sun or the map"),
    (&["Hold X"], "Show the other of A and B"),
];

/// The words on the key caps of a shortcut.
pub fn caps((modifiers, key): (Modifiers, Key)) -> Vec<String> {
    let mut caps = Vec::new();
    if modifiers.command {
        caps.push(if cfg!(target_os = "macos") { "Cmd" } else { "Ctrl" }.to_owned());
    }
    if modifiers.alt {
        caps.push("Alt".into());
    }
    if modifiers.shift {
        caps.push("Shift".into());
    }
    caps.push(key.symbol_or_name().to_owned());
    caps
}

/// The first shortcut of an action as text: `Ctrl+Z`.
pub fn shortcut(action: Action) -> String {
    let row = ACTIONS.iter().find(|row| row.action == action);
    row.and_then(|row| row.keys.first()).map(|&key| caps(key).join("+")).unwrap_or_default()
}

/// The actions whose keys were pressed, taken out of the input. Bare keys count only where no widget has the keyboard.
pub fn pressed(ctx: &egui::Context) -> Vec<Action> {
    let typing = ctx.memory(|m| m.focused().is_some());
    let mut found = Vec::new();
    // By each event's own modifiers: the state at the end of a slow frame may be another.
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, physical_key, pressed: true, modifiers, .. } = event else { return true };
            // With Shift or Alt a digit's key may mean another sign, on some keyboards without them too.
            let digit = physical_key.filter(|k| (Key::Num0..=Key::Num9).contains(k));
            let by_place = || digit.and_then(|k| action_of(*modifiers, k, typing));
            let action = action_of(*modifiers, *key, typing).or_else(by_place);
            found.extend(action);
            action.is_none()
        });
    });
    if found.contains(&Action::Panel) {
        // Its key would also move the keyboard's focus.
        ctx.memory_mut(|memory| memory.move_focus(egui::FocusDirection::None));
    }
    found
}

/// The action of a key; `typing`: a widget has the keyboard, so that bare keys are its own.
fn action_of(modifiers: Modifiers, key: Key, typing: bool) -> Option<Action> {
    let function_key = matches!(key, Key::F5 | Key::F11 | Key::F12);
    let bare = !modifiers.command && !modifiers.alt && !function_key;
    if bare && typing {
        return None;
    }
    let fits = |&(wanted, k): &(Modifiers, Key)| {
        // A question mark needs Shift on some keyboards and not on others.
        k == key && (modifiers.matches_exact(wanted) || key == Key::Questionmark)
    };
    ACTIONS.iter().find(|row| row.keys.iter().any(fits)).map(|row| row.action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things_and_flying_keys_are_free() {
        let mut seen: Vec<(Modifiers, Key)> = Vec::new();
        for row in ACTIONS {
            for &(modifiers, key) in row.keys {
                assert!(!seen.contains(&(modifiers, key)), "{key:?} of {}", row.text);
                seen.push((modifiers, key));
                let flies = matches!(key, Key::W | Key::A | Key::S | Key::D | Key::Q | Key::E);
                assert!(!flies || modifiers != Modifiers::NONE, "{key:?} is for flying");
            }
        }
    }

    #[test]
    fn keys_find_their_actions() {
        let ctrl = Modifiers { ctrl: true, command: true, ..Modifiers::NONE };
        assert_eq!(action_of(ctrl, Key::Z, true), Some(Action::Undo));
        assert_eq!(action_of(ctrl | Modifiers::SHIFT, Key::Z, false), Some(Action::Redo));
        assert_eq!(action_of(NONE, Key::F, false), Some(Action::Frame));
        assert_eq!(action_of(NONE, Key::F, true), None, "a field has the keyboard");
        assert_eq!(action_of(NONE, Key::F12, true), Some(Action::Capture));
        assert_eq!(action_of(NONE, Key::W, false), None);
        assert_eq!(action_of(ALT, Key::Num2, true), Some(Action::GoTo(1)));
        assert_eq!(action_of(ALT | SHIFT, Key::Num4, true), Some(Action::Store(3)));
    }
}
