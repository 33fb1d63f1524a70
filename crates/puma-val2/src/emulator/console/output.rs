//! Output of programs: `TYPE` and `PROMPT`.

use crate::emulator::console::display;
use crate::emulator::console::mode::Mode;
use crate::emulator::controller::Emulator;
use crate::emulator::language::expr::Variable;
use crate::emulator::language::item::Item;
use crate::emulator::message::Fault;

impl Emulator {
    pub(crate) fn type_items(&mut self, items: &[Item]) -> Result<(), Fault> {
        let mut text = String::new();
        let mut stay = false;
        let mut format = None;
        for item in items {
            match item {
                Item::Text(words) => text.push_str(words),
                Item::Value(value) => {
                    let value = value.value(&self.scope())?;
                    match format {
                        Some((width, decimals)) => {
                            text.push_str(&display::number(value, width, decimals));
                        }
                        None => text.push_str(&format!(" {}", display::plain(value))),
                    }
                }
                Item::Blanks(n) => text.push_str(&" ".repeat(*n)),
                Item::Lines(n) => text.push_str(&self.profile.eol.repeat(*n)),
                Item::Stay => stay = true,
                Item::Format(new) => format = *new,
            }
        }
        if matches!(self.mode, Mode::Monitor) && !self.type_stays {
            self.terminal.fresh_line(&self.profile, self.now);
        }
        self.type_stays = stay;
        self.print(&text);
        if !stay {
            self.print(self.profile.eol);
        }
        Ok(())
    }

    pub(crate) fn ask_values(&mut self, text: &str, variables: Vec<Variable>) {
        self.terminal.resume();
        self.terminal.fresh_line(&self.profile, self.now);
        self.print(text);
        self.mode = Mode::Answer(variables);
    }
}
