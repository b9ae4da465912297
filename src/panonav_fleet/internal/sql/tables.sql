CREATE TABLE panonav.schema_version(version integer NOT NULL);
INSERT INTO panonav.schema_version VALUES (1);

-- Whose memories a login sees. Logins that are not listed are all of the fleet ''. By the login
-- itself, as whoever is a member of a role may take that role's name.
CREATE TABLE panonav.members(login name PRIMARY KEY, fleet text COLLATE "C" NOT NULL);
CREATE FUNCTION panonav.fleet() RETURNS text LANGUAGE sql STABLE AS
  $$ SELECT coalesce((SELECT fleet FROM panonav.members WHERE login = session_user), '') $$;

-- `channel` cannot be guessed: only who may read the memory can listen to its changes. `identity`
-- says which memory this is, whatever its name is and whichever server it lies on.
CREATE TABLE panonav.memories(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  fleet text COLLATE "C" NOT NULL DEFAULT panonav.fleet(),
  name text COLLATE "C" NOT NULL,
  last_view bigint NOT NULL DEFAULT 0,
  channel text NOT NULL DEFAULT 'panonav_' || replace(gen_random_uuid()::text, '-', ''),
  identity text COLLATE "C" NOT NULL DEFAULT replace(gen_random_uuid()::text, '-', ''),
  UNIQUE (fleet, name));

CREATE TABLE panonav.robots(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  fleet text COLLATE "C" NOT NULL DEFAULT panonav.fleet(),
  name text COLLATE "C" NOT NULL,
  UNIQUE (fleet, name));
-- A connection that added views.
CREATE TABLE panonav.sessions(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  memory bigint NOT NULL REFERENCES panonav.memories ON DELETE CASCADE,
  robot bigint NOT NULL REFERENCES panonav.robots,
  login name NOT NULL DEFAULT session_user,
  began timestamptz NOT NULL DEFAULT now());

CREATE TABLE panonav.settings(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  key text COLLATE "C",
  integer_value bigint, real_value double precision, text_value text, bytes_value bytea,
  checksum bigint NOT NULL,
  PRIMARY KEY (memory, key),
  CHECK (num_nonnulls(integer_value, real_value, text_value, bytes_value) = 1));

-- A row that breaks a CHECK would be left out by every reader (validate of reference_validation.hpp).
-- Signatures do not compress and are as long as a quarter of a page: they stay in their row.
CREATE TABLE panonav.views(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  id bigint CHECK (id BETWEEN 1 AND 4294967295),
  name text COLLATE "C" NOT NULL CHECK (octet_length(name) BETWEEN 1 AND 4096),
  x_m double precision CHECK (x_m BETWEEN -1e7 AND 1e7),
  y_m double precision CHECK (y_m BETWEEN -1e7 AND 1e7),
  heading_rad double precision CHECK (heading_rad BETWEEN -1e300 AND 1e300),
  stamp_s double precision CHECK (stamp_s BETWEEN -1e12 AND 1e12),
  session bigint,
  signature bytea NOT NULL,
  checksum bigint NOT NULL,
  PRIMARY KEY (memory, id),
  UNIQUE (memory, name)) WITH (toast_tuple_target = 8160);
ALTER TABLE panonav.views ALTER signature SET STORAGE EXTERNAL;
-- Bare columns: under row-level security no index on what a function makes of them is used, as the
-- function could tell rows of others by failing.
CREATE INDEX views_by_position ON panonav.views(memory, x_m, y_m) WHERE x_m IS NOT NULL;
-- Changes are found by checksums alone, without reading the rows, a hundred times as long.
CREATE INDEX views_by_checksum ON panonav.views(memory, id) INCLUDE (checksum);

CREATE TABLE panonav.thumbnails(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  view bigint, bytes bytea NOT NULL, checksum bigint NOT NULL, PRIMARY KEY (memory, view));
ALTER TABLE panonav.thumbnails ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE panonav.features(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  view bigint, bytes bytea NOT NULL, checksum bigint NOT NULL, PRIMARY KEY (memory, view));
ALTER TABLE panonav.features ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE panonav.links(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  a bigint CHECK (a > 0), b bigint CHECK (b BETWEEN a + 1 AND 4294967295),
  kind bigint NOT NULL CHECK (kind BETWEEN 0 AND 2), checksum bigint NOT NULL,
  PRIMARY KEY (memory, a, b));
CREATE INDEX links_by_b ON panonav.links(memory, b);
CREATE TABLE panonav.maps(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  name text COLLATE "C", nodes bytea NOT NULL, edges bytea NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, name));
CREATE TABLE panonav.routes(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  name text COLLATE "C", columns bigint NOT NULL, lines bigint NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, name));
CREATE TABLE panonav.route_blocks(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  route text COLLATE "C", number bigint, lines bytea NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, route, number));
ALTER TABLE panonav.route_blocks ALTER lines SET STORAGE EXTERNAL;

-- The last change that can be undone: every row before and after it, in order.
CREATE TABLE panonav.undo(
  memory bigint PRIMARY KEY REFERENCES panonav.memories ON DELETE CASCADE, what text NOT NULL);
CREATE TABLE panonav.undo_rows(
  number bigint GENERATED ALWAYS AS IDENTITY,
  memory bigint NOT NULL REFERENCES panonav.memories ON DELETE CASCADE,
  relation name NOT NULL, before text, after text, PRIMARY KEY (memory, number));

-- What was taken last from a view of a robot's file, in the transaction that took it. A row stays
-- when somebody removes the view: a robot that missed the answer does not bring it back.
CREATE TABLE panonav.uploads(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  file text COLLATE "C", view bigint, signature bigint,
  server_view bigint NOT NULL, local_checksum bigint NOT NULL, server_checksum bigint NOT NULL,
  sent bigint NOT NULL,
  PRIMARY KEY (memory, file, view, signature, server_view));
