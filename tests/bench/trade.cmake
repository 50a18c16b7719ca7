# The trade of time and bytes against error: a library, so that its parts can be tested, and the tool.
if(TARGET kiln_bake)
  kiln_library(kiln_trade_parts
    SOURCES trade/child.cpp trade/choose.cpp trade/csv.cpp trade/front.cpp trade/pictures.cpp trade/plot.cpp
            trade/ratios.cpp trade/row.cpp trade/run.cpp trade/scenes.cpp trade/svg.cpp trade/sweep.cpp
    LINKS kiln_bake PRIVATE_LINKS nlohmann_json::nlohmann_json)
  target_compile_definitions(kiln_trade_parts PRIVATE KILN_SHARED="${PROJECT_SOURCE_DIR}/../shared")
  add_executable(kiln-trade trade/main.cpp)
  kiln_flags(kiln-trade)
  target_link_libraries(kiln-trade PRIVATE kiln_trade_parts)

  kiln_test(trade_test SOURCES trade/trade_test.cpp LINKS kiln_trade_parts)
  # The whole tool in some seconds: a first run, then one that finds everything done.
  add_test(NAME trade.smoke COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/trade/smoke.sh $<TARGET_FILE:kiln-trade>)
  set_tests_properties(trade.smoke PROPERTIES TIMEOUT 300)
endif()
