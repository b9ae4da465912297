DO $$
DECLARE part text;
BEGIN
  FOREACH part IN ARRAY ARRAY['settings', 'views', 'thumbnails', 'features', 'links', 'maps',
                              'routes', 'route_blocks', 'sessions', 'uploads', 'undo',
                              'undo_rows'] LOOP
    EXECUTE format('ALTER TABLE panonav.%I ENABLE ROW LEVEL SECURITY', part);
    EXECUTE format('CREATE POLICY own_fleet ON panonav.%I USING (memory IN '
                   '(SELECT id FROM panonav.memories))', part);
    CONTINUE WHEN part IN ('sessions', 'uploads', 'undo', 'undo_rows');
    EXECUTE format('CREATE TRIGGER keep_for_undo AFTER INSERT OR UPDATE OR DELETE ON panonav.%I '
      'FOR EACH ROW WHEN (current_setting(''panonav.undo'', true) = ''on'') '
      'EXECUTE FUNCTION panonav.keep_for_undo()', part);
  END LOOP;
END $$;
ALTER TABLE panonav.memories ENABLE ROW LEVEL SECURITY;
CREATE POLICY own_fleet ON panonav.memories USING (fleet = (SELECT panonav.fleet()));
ALTER TABLE panonav.robots ENABLE ROW LEVEL SECURITY;
CREATE POLICY own_fleet ON panonav.robots USING (fleet = (SELECT panonav.fleet()));
ALTER TABLE panonav.members ENABLE ROW LEVEL SECURITY;
CREATE POLICY oneself ON panonav.members USING (login = session_user);
-- What views are made with is fixed when the memory is made.
CREATE POLICY fixed_header ON panonav.settings AS RESTRICTIVE FOR UPDATE
  USING (key LIKE 'parameter.%');

GRANT USAGE ON SCHEMA panonav TO panonav_reader;
GRANT SELECT ON ALL TABLES IN SCHEMA panonav TO panonav_reader;
GRANT INSERT ON panonav.memories, panonav.robots, panonav.sessions, panonav.settings, panonav.views,
  panonav.thumbnails, panonav.features, panonav.links, panonav.maps, panonav.routes,
  panonav.route_blocks, panonav.uploads TO panonav_contributor;
GRANT UPDATE(last_view) ON panonav.memories TO panonav_contributor;
GRANT UPDATE ON panonav.settings, panonav.links, panonav.maps, panonav.routes, panonav.route_blocks
  TO panonav_contributor;
GRANT UPDATE ON panonav.views, panonav.uploads TO panonav_curator;
GRANT DELETE ON panonav.memories, panonav.settings, panonav.views, panonav.thumbnails,
  panonav.features, panonav.links, panonav.maps, panonav.routes, panonav.route_blocks
  TO panonav_curator;
GRANT INSERT, UPDATE, DELETE ON panonav.undo, panonav.undo_rows TO panonav_curator;
