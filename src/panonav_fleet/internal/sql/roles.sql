CREATE SCHEMA panonav;
REVOKE ALL ON SCHEMA panonav FROM PUBLIC;
DO $$
DECLARE role_name text;
BEGIN
  FOREACH role_name IN ARRAY ARRAY['panonav_reader', 'panonav_contributor', 'panonav_curator'] LOOP
    BEGIN
      IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = role_name) THEN
        EXECUTE format('CREATE ROLE %I NOLOGIN', role_name);
      END IF;
    EXCEPTION WHEN duplicate_object OR unique_violation THEN NULL;
    END;
  END LOOP;
END $$;
GRANT panonav_reader TO panonav_contributor;
GRANT panonav_contributor TO panonav_curator;
