// An answer of the library in words: {state, title, facts, sentence, mark, place, others}.

const lengthOf = (object, name) => object[`${name}_m`] ?? object[`${name}_steps`] ?? null;
const roundTo = (value) => value.toFixed(Math.abs(value) < 100 ? 2 : 0);

export function percent(probability) {
  if (probability > 0.99) return "over 99 %";
  if (probability < 0.01) return "under 1 %";
  return `${Math.round(100 * probability)} %`;
}

/** Names of files are shown without folder and ending. */
export const shortName = (name) => name.replace(/^.*\//, "").replace(/\.(png|jpe?g)$/i, "");

function positionText(position, unit) {
  const text = `x ${roundTo(lengthOf(position, "x"))}, y ${roundTo(lengthOf(position, "y"))} ${unit}`;
  const radius = lengthOf(position, "radius");
  return radius === null ? text : `${text}, within ${roundTo(radius)} ${unit}`;
}

const directions = ["right", "upper right", "top", "upper left", "left", "lower left", "bottom", "lower right"];
function headingOnMap(heading) {
  const eighth = Math.round((4 * heading) / Math.PI);
  return `towards the ${directions[((eighth % 8) + 8) % 8]} of the map (${Math.round((heading * 180) / Math.PI)}°)`;
}
function headingInPicture(heading) {
  const degrees = Math.round((Math.abs(heading) * 180) / Math.PI);
  if (degrees < 5) return "the same way as in the picture of the place";
  if (degrees > 175) return "the opposite way to the picture of the place";
  return `turned ${degrees}° to the ${heading > 0 ? "left" : "right"} of the picture of the place`;
}

/** `unit`: of the memory's positions; `count`: number of its places. */
export function explain(answer, unit, count) {
  if (!answer.known) {
    const certainty = percent(1 - answer.known_probability);
    return {
      state: "unknown",
      title: "I do not know this place",
      facts: [["Certainty", certainty, 1 - answer.known_probability]],
      text: `The picture looks like none of the ${count} places. It may be of another place, or too much has changed.`,
      sentence: `I do not know this place. Certainty ${certainty}.`,
      mark: null, place: null, others: [],
    };
  }
  const [match] = answer.matches;
  const { position } = answer;
  const heading = position ? answer.heading_rad : match.heading_rad;
  const looking = heading === null ? null : position ? headingOnMap(heading) : headingInPicture(heading);
  const facts = [["Certainty", percent(answer.probability), answer.probability]];
  if (answer.floor) facts.push(["Floor", answer.floor]);
  if (position) facts.push(["Position", positionText(position, unit)]);
  if (looking) facts.push(["You look", looking, undefined, heading]);
  const others = answer.alternatives.map((other) => ({
    text: `${shortName(other.match.file)} (${percent(other.probability)})`, position: other.position,
  }));
  return {
    state: "known",
    title: `You are near ${shortName(match.file)}`,
    facts,
    text: others.length === 0 ? "" : `It could also be near ${others.map(({ text }) => text).join(", ")}.`,
    sentence: [`You are near ${shortName(match.file)}.`, `Certainty ${percent(answer.probability)}.`,
      looking && `You look ${looking}.`].filter(Boolean).join(" "),
    mark: position && {
      x: lengthOf(position, "x"), y: lengthOf(position, "y"), radius: lengthOf(position, "radius"), heading,
      others: others.filter((other) => other.position).map((other) => ({ x: lengthOf(other.position, "x"), y: lengthOf(other.position, "y") })),
    },
    place: match.file, others,
  };
}
